"""Sweeps in, messages out."""

from __future__ import annotations

import math

import msgspec
import pytest

from rhot.clock import Offset
from rhot.messages.objects import OpenVrEvent, OpenVrPose
from services.openvr_bridge.step import BridgeStep
from services.openvr_bridge.sweep import Device, Event, Sweep
from testing.steamvr import BASE_STATION, HMD, IDENTITY, NO_SLOT, REDIRECT, TRACKER, Slot, records

NOW_NS = 1_700_000_000_000_000_000
HERE = Offset(0, -1)


def sweep(devices: dict[int, Device], slots: dict[int, Slot] | None = None, *events) -> Sweep:
    return Sweep(NOW_NS, records(slots or {slot: Slot() for slot in devices}), devices, events)


def test_a_pose_carries_the_clock_and_the_device():
    step = BridgeStep()
    devices = {3: Device(TRACKER, "LHR-1", "VIVE Tracker 3.0", 0.42, True, 7, "lighthouse")}
    slot = Slot(matrix=((0, -1, 0, 0.1), (1, 0, 0, -0.2), (0, 0, 1, 3)), velocity=(0.1, 0, 0))
    (pose,) = step.poses(sweep(devices, {3: slot}), Offset(1234, 56))
    assert (pose.stamp_ns, pose.clock_offset_ns, pose.clock_sigma_ns) == (NOW_NS, 1234, 56)
    assert pose.universe == "raw:7"
    assert pose.mDeviceToAbsoluteTracking == (
        (0.0, -1.0, 0.0, 0.1),
        (1.0, 0.0, 0.0, -0.2),
        (0.0, 0.0, 1.0, 3.0),
    )
    assert (pose.device.index, pose.device.battery, pose.device.charging) == (3, 0.42, True)
    assert msgspec.json.decode(msgspec.json.encode(pose), type=OpenVrPose) == pose


def test_messages_are_counted_for_each_serial():
    step = BridgeStep()
    one = {3: Device(TRACKER, "A")}
    both = one | {4: Device(TRACKER, "B")}
    told = [pose for each in (one, both, one, both) for pose in step.poses(sweep(each), HERE)]
    assert [(pose.device.serial, pose.seq) for pose in told] == [
        ("A", 0),
        ("A", 1),
        ("B", 0),
        ("A", 2),
        ("A", 3),
        ("B", 1),
    ]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("where", ["matrix", "velocity", "angular_velocity"])
def test_numbers_that_are_not_finite_are_an_invalid_pose(bad, where):
    values = ((1, 0, 0, 0), (0, bad, 0, 0), (0, 0, 1, 0)) if where == "matrix" else (0, 0, bad)
    slots = {1: Slot(**{where: values}), 2: Slot(velocity=(1, 2, 3))}
    devices = {1: Device(TRACKER, "A"), 2: Device(TRACKER, "B")}
    broken, well = BridgeStep().poses(sweep(devices, slots), HERE)
    assert not broken.bPoseIsValid
    assert broken.mDeviceToAbsoluteTracking == ((0.0,) * 4,) * 3
    assert (broken.vVelocity, broken.vAngularVelocity) == ((0.0,) * 3,) * 2
    assert (well.bPoseIsValid, well.vVelocity) == (True, (1.0, 2.0, 3.0))


def test_base_stations_and_redirected_displays_are_no_objects():
    devices = {
        0: Device(HMD, "H"),
        1: Device(BASE_STATION, "LHB-1"),
        2: Device(REDIRECT, "R"),
        5: Device(TRACKER, "T"),
    }
    assert [p.device.serial for p in BridgeStep().poses(sweep(devices), HERE)] == ["H", "T"]


def test_64_devices():
    devices = {slot: Device(TRACKER, f"LHR-{slot}") for slot in range(64)}
    assert [p.device.index for p in BridgeStep().poses(sweep(devices), HERE)] == list(range(64))


def test_of_two_with_one_serial_the_lower_slot_is_sent():
    step = BridgeStep()
    devices = {3: Device(TRACKER, "A"), 9: Device(TRACKER, "A"), 10: Device(TRACKER, "B")}
    slots = {slot: Slot(velocity=(slot, 0, 0)) for slot in devices}
    told = step.poses(sweep(devices, slots), HERE)
    assert [(p.device.serial, p.vVelocity[0]) for p in told] == [("A", 3.0), ("B", 10.0)]
    assert step.twice == {"A": [3, 9]}
    # The lower one is switched off: the other is the tracker, and nothing is wrong.
    slots[3].connected = False
    told = step.poses(sweep(devices, slots), HERE)
    assert [p.device.index for p in told] == [9, 10]
    assert step.twice == {}


def test_serials_that_change_for_ever_do_not_fill_the_memory():
    step = BridgeStep()
    sent = sum(len(step.poses(sweep({1: Device(TRACKER, f"LHR-{n}")}), HERE)) for n in range(300))
    assert sent == 256


def test_a_device_that_sleeps_keeps_reporting():
    slot = Slot(matrix=((0,) * 4,) * 3, result=1, valid=False, connected=False)
    (pose,) = BridgeStep().poses(sweep({1: Device(TRACKER, "A")}, {1: slot}), HERE)
    assert (pose.bPoseIsValid, pose.bDeviceIsConnected, pose.eTrackingResult) == (False, False, 1)


def test_events_are_stamped_when_they_happened():
    devices = {3: Device(TRACKER, "LHR/1", universe_id=7)}
    events = [Event(100, 3, 0.5), Event(801, NO_SLOT, math.nan), Event(111, 3, 0.0)]
    first, second = BridgeStep().events(sweep(devices, None, *events), Offset(5, 6))
    assert first == OpenVrEvent(
        v=1,
        stamp_ns=NOW_NS - 500_000_000,
        event_type=100,
        name="TrackedDeviceActivated",
        serial="LHR_1",
        universe="raw:7",
        clock_offset_ns=5,
    )
    assert (second.stamp_ns, second.serial, second.universe) == (NOW_NS, "", "raw:7")


@pytest.mark.parametrize("age_s", [-1.0, 1e30, math.inf])
def test_an_age_that_cannot_be_is_none(age_s):
    (event,) = BridgeStep().events(sweep({}, None, Event(700, NO_SLOT, age_s)), HERE)
    assert (event.stamp_ns, event.universe) == (NOW_NS, "raw")


def test_matrices_are_sent_as_they_are():
    """Half turns, mirrors and shears: the bridge judges nothing, the object tracker does."""
    matrices = [
        ((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0)),
        ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0)),
        ((2, 1, 0, 1e6), (0, 1, 0, 0), (0, 0, 1, 0)),
        IDENTITY,
    ]
    for matrix in matrices:
        (pose,) = BridgeStep().poses(
            sweep({1: Device(TRACKER, "A")}, {1: Slot(matrix=matrix)}), HERE
        )
        assert pose.mDeviceToAbsoluteTracking == tuple(tuple(map(float, row)) for row in matrix)
