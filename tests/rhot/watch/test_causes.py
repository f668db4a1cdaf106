"""Of a dozen faults the one to act on first, and the others under what they follow from."""

from __future__ import annotations

from rhot.faults import FAULTS
from rhot.faults.way import FOLLOWING, WAY
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable
from rhot.watch.causes import causes
from rhot.watch.rig_monitor import RigMonitor
from rhot.watch.rig_state import StandingFault
from testing.sample_health import NOW_NS, SECOND_NS, beat, fault

SLOW_POSES = "rhot/sim/hand/*/pose: 0.0 a second received instead of 30.0"
SLOW_MARKERS = "rhot/sim/camera/*/markers: 12.0 a second received instead of 60.0"
SLOW_OBJECTS = "rhot/sim/object/*/pose: 0.0 a second received instead of 120.0"


def told(code: str, teller: str = "", subject: str = "", text: str = "wrong") -> StandingFault:
    return StandingFault(teller=teller, fault=fault(code, text, subject))


def codes(faults: list[StandingFault]) -> list[tuple[str, list[str]]]:
    return [(c.fault.fault.code, [f.fault.code for f in c.follows]) for c in causes(faults)]


def test_codes_of_the_way_are_codes() -> None:
    of_way = [code for codes_ in WAY for code in codes_]
    assert len(of_way) == len(set(of_way))
    assert {*of_way, *FOLLOWING} <= set(FAULTS)


def test_where_nothing_runs_one_thing_is_to_be_done() -> None:
    config = RigConfig(
        camera=[CameraTable(name="left"), CameraTable(name="right")],
        hand={"right": HandTable(markers={"wrist": "violet"})},
    )
    monitor = RigMonitor(config, NOW_NS)
    later_ns = NOW_NS + 5 * SECOND_NS
    slow = fault("stream_slow", SLOW_POSES)
    monitor.beat(beat("viewer", faults=[slow]), later_ns)
    (cause,) = causes(monitor.state(later_ns).faults)
    assert cause.fault.fault.code == "service_absent"
    assert cause.fault.fault.text == (
        "4 programs of this rig do not run: the tracker of camera left, the tracker of camera "
        "right, fusion and the solver"
    )
    assert "rhot up rig.toml" in cause.fault.fault.action
    # What is wrong with each, and the stream that nobody sends.
    assert len(cause.follows) == 5


def test_one_missing_service_is_told_in_its_own_words() -> None:
    alone = told("service_gone", subject="solver", text="the solver has ended")
    (cause,) = causes([alone, told("no_pose"), told("stream_slow", "viewer", text=SLOW_POSES)])
    assert cause.fault == alone
    assert [one.fault.code for one in cause.follows] == ["no_pose", "stream_slow"]


def test_simulated_cameras_are_slow_for_want_of_the_simulator() -> None:
    gone = told("service_gone", subject="simulator", text="the simulator has ended")
    slow = told("camera_slow", "pi_tracker/left", "left")
    assert codes([slow, gone]) == [("service_gone", ["camera_slow"])]
    other = told("service_gone", subject="solver", text="the solver has ended")
    assert codes([slow, other]) == [("service_gone", []), ("camera_slow", [])]


def test_a_dark_camera_explains_its_own_markers_and_no_others() -> None:
    dark = told("camera_dark", "pi_tracker/left", "left")
    assert codes([told("no_points"), told("marker_not_seen", "pi_tracker/left"), dark]) == [
        ("camera_dark", ["marker_not_seen", "no_points"])
    ]
    assert codes([told("marker_not_seen", "pi_tracker/right"), dark]) == [
        ("camera_dark", []),
        ("marker_not_seen", []),
    ]


def test_what_follows_from_nothing_stands_for_itself_and_explains_what_is_behind_it() -> None:
    assert codes([told("stream_slow", "fusion"), told("disk_low", "fusion")]) == [
        ("disk_low", []),
        ("stream_slow", []),
    ]
    assert codes([told("no_pose"), told("session_stopped")]) == [("session_stopped", ["no_pose"])]


def test_objects_and_hands_do_not_explain_each_other() -> None:
    lost = told("source_lost", "openvr_bridge", text="SteamVR has ended")
    slow = told("stream_slow", "viewer", text=SLOW_OBJECTS)
    assert codes([told("no_pose"), slow, lost]) == [
        ("source_lost", ["stream_slow"]),
        ("no_pose", []),
    ]
    assert codes([slow, told("camera_moved", "fusion", "left")])[0] == ("camera_moved", [])


def test_what_the_object_tracker_misses_of_slow_cameras_follows_from_them() -> None:
    camera = told("camera_slow", "pi_tracker/left", "left")
    slow = told("stream_slow", "object_tracker", text=SLOW_MARKERS)
    assert codes([slow, camera]) == [("camera_slow", ["stream_slow"])]


def test_errors_come_before_warnings_and_nothing_is_lost() -> None:
    every = [told(code, "fusion", text=code) for code in FAULTS]
    found = causes(every)
    texts = [c.fault.fault.text for c in found] + [f.fault.text for c in found for f in c.follows]
    assert set(FAULTS) <= set(texts)
    severities = [c.fault.fault.severity for c in found]
    assert severities[0] == "error"
    assert found[0].fault.fault.code in WAY[0]
