"""Conditions begin and end, each with one line; events pass; strangers' names are bounded."""

import logging

import pytest

from rhot.errors import RhotError
from rhot.faults import FAULTS
from rhot.messages.health import MAX_FAULTS
from rhot.process.fault_log import EVENT_S, FaultLog, one_line

S = 1_000_000_000


class Clock:
    def __init__(self):
        self.ns = 1_700_000_000 * S

    def __call__(self):
        return self.ns

    def wait(self, seconds):
        self.ns += round(seconds * S)


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def faults(clock):
    return FaultLog(clock)


def test_a_condition_is_told_when_it_begins_and_when_it_ends(faults, clock, caplog):
    with caplog.at_level(logging.INFO, "rhot.faults"):
        began_ns = clock.ns
        for seconds in range(5):
            faults.report("camera_dark", f"left: black for {seconds} s", "left")
            clock.wait(1)
        (fault,) = faults.standing()
        assert (fault.code, fault.severity, fault.subject) == ("camera_dark", "error", "left")
        assert fault.text == "left: black for 4 s"
        assert fault.since_ns == began_ns
        assert "`rhot calibrate camera left`" in fault.action
        assert one_line(fault).endswith("[camera_dark]")
        faults.clear("camera_dark", "left")
        faults.clear("camera_dark", "left")
        assert faults.standing() == []
    assert [record.levelname for record in caplog.records] == ["ERROR", "INFO"]
    assert "over after 5 s" in caplog.text


def test_an_event_passes_by_itself(faults, clock):
    faults.event("request_refused", "no", "left")
    clock.wait(EVENT_S / 2)
    faults.event("request_refused", "no again", "left")
    clock.wait(EVENT_S / 2 + 1)
    assert [fault.text for fault in faults.standing()] == ["no again"]
    clock.wait(EVENT_S / 2)
    assert faults.standing() == []


def test_replace_ends_what_is_not_named(faults):
    faults.report("marker_not_seen", "blue is gone", "blue")
    faults.report("camera_dark", "black", "left")
    faults.replace("marker_not_seen", {"lime": "lime is gone"}, {"lime": "look for it"})
    standing = {(fault.code, fault.subject): fault.action for fault in faults.standing()}
    assert set(standing) == {("camera_dark", "left"), ("marker_not_seen", "lime")}
    assert standing["marker_not_seen", "lime"] == "look for it"


def test_errors_stand_before_warnings_then_the_oldest(faults, clock):
    for code in ("disk_low", "camera_dark", "stream_slow", "disk_full"):
        faults.report(code, code)
        clock.wait(1)
    codes = [fault.code for fault in faults.standing()]
    assert codes == ["camera_dark", "disk_full", "disk_low", "stream_slow"]


def test_strangers_names_do_not_fill_the_memory(faults, clock):
    for number in range(10_000):
        faults.event("device_unknown", "x" * 10_000, f"device{number}" * 100)
    standing = faults.standing()
    assert len(standing) == MAX_FAULTS
    assert all(len(fault.text) <= 1000 and len(fault.subject) <= 100 for fault in standing)
    clock.wait(EVENT_S + 1)
    assert faults.standing() == []
    faults.report("camera_dark", "black", "left")
    assert len(faults.standing()) == 1


def test_a_code_that_is_not_in_the_list_is_a_mistake_of_ours(faults):
    with pytest.raises(RhotError, match="no fault code"):
        faults.report("oops", "text")


def test_every_kind_says_what_it_means_and_what_to_do():
    for code, kind in FAULTS.items():
        assert kind.code == code
        assert kind.meaning
        assert kind.action
        assert not kind.meaning.endswith(".")
