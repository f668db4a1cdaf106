"""The states of services, and the faults an onlooker finds, from beats and tokens."""

from __future__ import annotations

import msgspec
import pytest

from rhot.faults import FAULTS
from rhot.files.config import RigConfig
from rhot.files.rig_tables import (
    Bus,
    CameraTable,
    HandTable,
    Objects,
    ObjectTable,
    RigTable,
)
from rhot.watch.onlooker_faults import unit
from rhot.watch.rig_monitor import RigMonitor, expected_services
from rhot.watch.rig_state import ServiceRow
from testing.sample_health import NOW_NS, SECOND_NS, beat, fault, stream

CONFIG = RigConfig(
    rig=RigTable(name="sim"),
    camera=[CameraTable(name="left", host="pi-left"), CameraTable(name="right", host="pi-right")],
    hand={"right": HandTable(markers={"index_tip": "blue", "thumb_tip": "red"})},
)
SERVICES = [("pi_tracker", "left"), ("pi_tracker", "right"), ("fusion", "main"), ("solver", "main")]


@pytest.fixture
def monitor():
    return RigMonitor(CONFIG, NOW_NS)


@pytest.fixture
def all_well(monitor):
    for service, instance in SERVICES:
        monitor.token(service, instance, True, NOW_NS)
        monitor.beat(beat(service, instance), NOW_NS)
    return monitor


def states(monitor, after_s=0):
    rows = monitor.state(NOW_NS + after_s * SECOND_NS).services
    return {row.name: row.state for row in rows}


def codes(monitor, after_s=0):
    faults = monitor.state(NOW_NS + after_s * SECOND_NS).faults
    return [(one.fault.code, one.fault.subject) for one in faults]


def test_what_never_came_is_absent_and_says_on_which_host(monitor):
    assert not monitor.state(NOW_NS).faults  # tokens may still be on their way
    state = monitor.state(NOW_NS + SECOND_NS)
    assert {row.state for row in state.services} == {"absent"}
    assert not state.healthy
    (left,) = [one.fault for one in state.faults if one.fault.subject == "pi_tracker/left"]
    assert left.code == "service_absent"
    assert "pi-left" in left.action
    assert "rhot-pi-tracker@left" in left.action
    (fusion,) = [one.fault for one in state.faults if one.fault.subject == "fusion"]
    assert "on the master" in fusion.action


def test_running_silent_and_gone(all_well):
    assert all_well.state(NOW_NS + SECOND_NS).healthy
    assert codes(all_well) == []
    assert set(states(all_well, after_s=4).values()) == {"silent"}
    assert ("service_silent", "solver") in codes(all_well, after_s=4)
    all_well.token("solver", "main", False, NOW_NS + SECOND_NS)
    assert states(all_well, after_s=1)["solver"] == "gone"
    assert codes(all_well, after_s=1) == [("service_gone", "solver")]


def test_a_service_that_comes_back_is_no_fault_any_more(all_well):
    all_well.token("solver", "main", False, NOW_NS + SECOND_NS)
    all_well.beat(beat(state="starting"), NOW_NS + 2 * SECOND_NS)
    assert states(all_well, after_s=2)["solver"] == "starting"
    all_well.token("solver", "main", True, NOW_NS + 3 * SECOND_NS)
    all_well.beat(beat(), NOW_NS + 3 * SECOND_NS)
    assert states(all_well, after_s=3)["solver"] == "running"
    assert ("service_gone", "solver") not in codes(all_well, after_s=3)


def test_a_waiting_tracker_whose_token_goes_is_gone(all_well):
    all_well.beat(beat("pi_tracker", "left", state="waiting"), NOW_NS)
    all_well.token("pi_tracker", "left", False, NOW_NS)
    assert states(all_well)["pi_tracker/left"] == "gone"


def test_the_lost_router_is_the_only_thing_said_without_it(all_well):
    all_well.connected(False, NOW_NS)
    assert codes(all_well, after_s=9) == [("router_unreachable", "router")]
    assert all_well.state(NOW_NS).connection == "lost"
    all_well.connected(True, NOW_NS)
    assert codes(all_well) == []


def test_errors_come_first_then_the_oldest(all_well):
    found = [fault("disk_low", since_s=9), fault("camera_dark", "dark", "left", since_s=2)]
    all_well.beat(beat("pi_tracker", "left", faults=found), NOW_NS)
    all_well.beat(beat("fusion", faults=[fault("camera_moved", since_s=5)]), NOW_NS)
    state = all_well.state(NOW_NS)
    assert [one.fault.code for one in state.faults] == ["camera_moved", "camera_dark", "disk_low"]
    assert [one.teller for one in state.faults] == ["fusion", "pi_tracker/left", "pi_tracker/left"]
    assert not state.healthy


def test_ages_add_up_to_the_age_of_the_pose(all_well):
    for camera, age_ms in (("left", 12.0), ("right", 14.0)):
        markers = stream(f"camera/{camera}/markers", latency_p50_ms=age_ms)
        all_well.beat(beat("pi_tracker", camera, streams=[markers]), NOW_NS)
    all_well.beat(
        beat("fusion", streams=[stream("hand/right/points", latency_p50_ms=15.5)]), NOW_NS
    )
    state = all_well.state(NOW_NS)
    (ages,) = state.ages
    assert (ages.tracker_ms, ages.fusion_ms, ages.solver_ms) == (12.0, 3.5, 5.5)
    assert ages.tracker_ms + ages.fusion_ms + ages.solver_ms == ages.pose_ms == 21.0
    assert state.glass_to_pose_ms == {"right": (21.0, 35.0)}


def test_no_stage_of_a_computer_that_stutters_took_less_than_nothing(all_well):
    """Each service's figure is of its own last seconds: points may seem younger than markers."""
    for camera, age_ms in (("left", 102.0), ("right", 104.0)):
        markers = stream(f"camera/{camera}/markers", latency_p50_ms=age_ms)
        all_well.beat(beat("pi_tracker", camera, streams=[markers]), NOW_NS)
    all_well.beat(
        beat("fusion", streams=[stream("hand/right/points", latency_p50_ms=84.0)]), NOW_NS
    )
    (ages,) = all_well.state(NOW_NS).ages
    assert (ages.tracker_ms, ages.fusion_ms, ages.solver_ms) == (21.0, 0.0, 0.0)
    assert ages.tracker_ms + ages.fusion_ms + ages.solver_ms == ages.pose_ms


def test_markers_seen_of_expected_by_camera(all_well):
    values = {"markers": 1.0}
    markers = stream("camera/left/markers")
    all_well.beat(beat("pi_tracker", "left", streams=[markers], values=values), NOW_NS)
    stopped = stream("camera/right/markers", rate_hz=0.0, ok=False)
    all_well.beat(beat("pi_tracker", "right", streams=[stopped], values=values), NOW_NS)
    left, right = all_well.state(NOW_NS).cameras
    assert (left.markers, left.expected_markers, left.rate_hz) == (1, 2, 30.0)
    # The count of a picture of long ago says nothing of now.
    assert right.markers == -1


def test_strangers_are_listed_but_bounded(all_well):
    all_well.token("bridge", "vmc", True, NOW_NS)
    assert states(all_well)["bridge/vmc"] == "alive"
    assert states(all_well, after_s=4)["bridge/vmc"] == "silent"
    assert codes(all_well) == []
    for number in range(1000):
        all_well.token("flood", str(number), True, NOW_NS)
        all_well.beat(beat("flood", str(number)), NOW_NS)
    assert len(all_well.state(NOW_NS).services) <= 64
    assert states(all_well)["solver"] == "running"


def test_every_code_an_onlooker_may_say_is_in_the_list():
    for code in ("router_unreachable", "service_absent", "service_gone", "service_silent"):
        assert code in FAULTS


@pytest.mark.parametrize(
    ("host", "sources", "expected"),
    [
        ("", (), ("openvr_bridge", "main")),
        ("", ("steamvr",), ("openvr_bridge", "main")),
        ("gaming-pc", ("steamvr", "other"), ("openvr_bridge", "steamvr")),
        ("gaming-pc", (), ("openvr_bridge", "main")),
    ],
)
def test_steamvrs_bridge_is_expected_under_its_name(host, sources, expected):
    config = RigConfig(
        bus=Bus(object_sources=sources),
        object=[ObjectTable(name="cup", serial="LHR-1")],
        objects=Objects(source="steamvr", host=host),
    )
    assert expected in expected_services(config)
    absent = [one.fault for one in RigMonitor(config, NOW_NS).state(NOW_NS + SECOND_NS).faults]
    (bridge,) = [fault for fault in absent if fault.subject.startswith("openvr_bridge")]
    assert "the bridge to SteamVR" in bridge.text
    assert (host or "the master") in bridge.action
    others = RigConfig(object=config.object, objects=Objects(source="libsurvive"))
    assert "openvr_bridge" not in dict(expected_services(others))


def test_the_paint_on_an_objects_tracker_is_no_marker_of_a_hand():
    """It turns away with the object, and nothing is wrong then."""
    cup = ObjectTable(name="cup", serial="LHR-1", marker="cyan")
    monitor = RigMonitor(msgspec.structs.replace(CONFIG, object=[cup]), NOW_NS)
    assert {row.expected_markers for row in monitor.state(NOW_NS).cameras} == {2}
    alone = msgspec.structs.replace(CONFIG, object=[cup], hand={})
    monitor = RigMonitor(alone, NOW_NS)
    assert {row.expected_markers for row in monitor.state(NOW_NS).cameras} == {1}


@pytest.mark.parametrize(
    ("service", "instance", "name"),
    [
        ("pi_tracker", "left", "rhot-pi-tracker@left"),
        ("fusion", "main", "rhot-fusion"),
        # Whose process solves.
        ("solver", "main", "rhot-fusion"),
        ("object_tracker", "main", "rhot-object-tracker"),
    ],
)
def test_a_service_is_looked_at_by_the_unit_that_runs_it(service, instance, name, repository):
    row = ServiceRow(service=service, instance=instance, state="gone", health=None)
    assert unit(row) == name
    file = f"{name.partition('@')[0]}{'@' if '@' in name else ''}.service"
    assert (repository / "deploy" / "systemd" / file).is_file()
