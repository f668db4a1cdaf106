"""When a rig is up, and what it lacks."""

from __future__ import annotations

import msgspec
import pytest

from rhot.bus.liveliness import Alive
from rhot.files.config import RigConfig
from services.cli.rig.readiness import Readiness
from testing.sample_health import beat, fault

CHILDREN = ["router", "pi_tracker/left", "fusion", "viewer"]


@pytest.fixture
def rig():
    cameras = [{"name": "left"}, {"name": "right", "host": "pi-right.local"}]
    return Readiness(msgspec.convert({"camera": cameras}, RigConfig), CHILDREN)


def come(rig, *names, alive=True):
    for name in names:
        service, _, instance = name.partition("/")
        rig.note_alive(Alive(service, instance or "main", alive))


def missing(rig, **reasons):
    return {one.who: one.why for one in rig.missing(reasons)}


def up(rig):
    rig.router = True
    come(rig, "pi_tracker/left", "pi_tracker/right", "fusion", "viewer")
    assert missing(rig) == {}


def test_without_a_router_nothing_else_counts(rig):
    assert missing(rig) == {"router": "starting"}
    assert missing(rig, router="the port is taken") == {"router": "the port is taken"}


def test_services_here_and_trackers_elsewhere_are_waited_for(rig):
    rig.router = True
    come(rig, "pi_tracker/left", "viewer")
    found = missing(rig, fusion="rig.json: no such file", viewer="of long ago")
    assert found["fusion"] == "rig.json: no such file"
    assert "pi-right.local" in found["pi_tracker/right"]
    assert set(found) == {"fusion", "pi_tracker/right"}


def test_it_is_up_until_somebody_goes(rig):
    up(rig)
    come(rig, "pi_tracker/right", alive=False)
    assert set(missing(rig)) == {"pi_tracker/right"}


def test_a_fault_that_stops_poses_keeps_it_from_being_up(rig):
    up(rig)
    rig.note_health(beat("fusion", faults=[fault("camera_silent", "no left"), fault("disk_low")]))
    assert missing(rig)["fusion"].startswith("no left; look at its tracker")
    rig.note_health(beat("fusion", faults=[fault("session_stopped")]))
    assert "session_stopped" in missing(rig)["fusion"]
    rig.note_health(beat("fusion"))
    assert missing(rig) == {}


def test_faults_of_strangers_and_of_the_gone_do_not_count(rig):
    up(rig)
    rig.note_health(beat("stranger", faults=[fault("camera_silent")]))
    rig.note_health(beat("fusion", faults=[fault("camera_silent")]))
    come(rig, "fusion", alive=False)
    come(rig, "fusion")
    assert missing(rig) == {}


def test_the_kind_stays_while_the_words_count_seconds(rig):
    up(rig)
    rig.note_health(beat("fusion", faults=[fault("camera_silent", "for 2 s")]))
    (before,) = rig.missing({})
    rig.note_health(beat("fusion", faults=[fault("camera_silent", "for 12 s")]))
    (after,) = rig.missing({})
    assert before.kind == after.kind
    assert before.why != after.why


def test_the_viewers_port(rig):
    rig.note_health(beat("viewer", values={"port": 8081.0}))
    assert rig.viewer_port == 8081
