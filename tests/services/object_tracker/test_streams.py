"""ObjectStep over streams of poses: old, repeated and foreign messages, clocks, silence."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.files.calibration import ObjectPlace
from rhot.files.config import RigConfig
from rhot.geometry.transforms import transform
from rhot.messages.objects import ObjectPose
from services.object_tracker.step import ObjectStep
from testing.openvr_poses import openvr_pose, registered

MS = 1_000_000
T0 = 1_700_000_000_000_000_000


def test_old_and_repeated_messages_are_counted_and_never_published(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    stream = [openvr_pose(seq=k, stamp_ns=T0 + k * 4 * MS) for k in range(2000)]
    for pose in stream:
        assert step.step(pose, pose.stamp_ns + MS) is not None
    now_ns = stream[-1].stamp_ns
    # All of it once more, in the next eight seconds and longer than any patience.
    for k, pose in enumerate(stream * 2):
        assert step.step(pose, now_ns + k * 4 * MS) is None
    values = step.values()
    assert values["left_out_out_of_order"] + values["left_out_repeated"] == 4000
    assert step.step(openvr_pose(seq=9000, stamp_ns=now_ns + 17_000 * MS)) is not None


@pytest.mark.parametrize(("shift_s", "reason"), [(3600, "future"), (-3600, "out_of_order")])
def test_a_stamp_of_another_time_does_not_stop_the_stream(
    config: RigConfig, shift_s: int, reason: str
) -> None:
    step = ObjectStep(config, registered())
    for k in range(50):
        stamp_ns = T0 + k * 4 * MS + (shift_s * 10**9 if k == 20 else 0)
        result = step.step(openvr_pose(seq=k, stamp_ns=stamp_ns), T0 + k * 4 * MS)
        assert (result is None) == (k == 20)
    assert step.values()[f"left_out_{reason}"] == 1


@pytest.mark.parametrize("shift_s", [-3600, 3600])
def test_a_clock_that_was_set_is_followed_after_two_seconds(
    config: RigConfig, shift_s: int
) -> None:
    step = ObjectStep(config, registered())
    shown = []
    for k in range(1500):
        stamp_ns = T0 + k * 4 * MS + (shift_s * 10**9 if k >= 500 else 0)
        shown.append(step.step(openvr_pose(seq=k, stamp_ns=stamp_ns), T0 + k * 4 * MS) is not None)
    assert all(shown[:500])
    assert not any(shown[500:950])
    assert all(shown[1010:])


def test_two_senders_the_second_is_left_out_and_told_while_it_is_there(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    there = transform(np.eye(3), [1.0, 0.0, 0.0])
    for k in range(500):
        at_ns = T0 + k * 4 * MS
        assert step.step(openvr_pose(seq=1000 + k, stamp_ns=at_ns), at_ns) is not None
        if 100 <= k < 200:
            other = openvr_pose(there, seq=k, stamp_ns=at_ns + 2 * MS, universe="other")
            assert step.step(other, at_ns + 2 * MS) is None
        if k in (105, 400):
            assert "LHR-1" in step.faults(at_ns)["device_twice"]
    assert step.values()["left_out_second_sender"] == 100
    assert not step.faults(T0 + 500 * 4 * MS + 5 * 10**9)["device_twice"]
    # Its universe did not make the registration stale either.
    assert not step.faults(T0)["registration_stale"]


def test_two_senders_that_count_alike(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    there = transform(np.eye(3), [1.0, 0.0, 0.0])
    shown = []
    for k in range(100):
        at_ns = T0 + k * 4 * MS
        shown.append(step.step(openvr_pose(seq=k, stamp_ns=at_ns), at_ns))
        assert step.step(openvr_pose(there, seq=k, stamp_ns=at_ns + MS), at_ns + MS) is None
    assert None not in shown
    assert step.faults(T0 + 400 * MS)["device_twice"]


def test_a_sender_started_again_counts_from_zero(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    for k in range(50):
        step.step(openvr_pose(seq=k + 1000, stamp_ns=T0 + k * MS), T0 + k * MS)
    again_ns = T0 + 500 * MS
    assert step.step(openvr_pose(seq=0, stamp_ns=again_ns), again_ns) is not None
    assert not step.faults(again_ns)["device_twice"]


def test_a_recording_is_replayed_with_its_own_stamps_and_again(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    now_ns = T0 + 10**18
    for begin_ns in (now_ns, now_ns + 30 * 10**9):
        for k in range(100):
            pose = openvr_pose(seq=k, stamp_ns=T0 + k * 10 * MS)
            assert step.step(pose, begin_ns + k * 10 * MS) is not None


def test_stamps_are_brought_to_the_masters_clock(config: RigConfig) -> None:
    place = ObjectPlace(time_offset_ns=30 * MS)
    step = ObjectStep(config, registered(objects={"cup": place}))
    # Two seconds ahead, and it does not know at first.
    for k in range(20):
        offset = {"clock_offset_ns": 2 * 10**9, "clock_sigma_ns": 1000} if k >= 10 else {}
        at_ns = T0 + k * 4 * MS
        result = step.step(openvr_pose(seq=k, stamp_ns=at_ns + 2 * 10**9, **offset), at_ns)
        assert result is not None
        assert result.stamp_ns == at_ns - 30 * MS + (0 if k >= 10 else 2 * 10**9)


def test_the_battery_is_told_until_it_is_charged(config: RigConfig) -> None:
    step = ObjectStep(config, registered())

    def told(k: int, battery: float, *, charging: bool = False) -> bool:
        pose = openvr_pose(seq=k, stamp_ns=T0 + k * MS)
        device = msgspec.structs.replace(pose.device, battery=battery, charging=charging)
        step.step(msgspec.structs.replace(pose, device=device))
        return bool(step.faults(T0)["device_battery"])

    levels = (0.5, 0.14, 0.16, 0.18, 0.0, -1.0)
    assert [told(k, level) for k, level in enumerate(levels)] == [False, True, True] + [False] * 3
    assert told(7, 0.05)
    assert not told(8, 0.05, charging=True)


def test_a_device_that_stops_is_lost_and_one_never_heard_is_nothing(config: RigConfig) -> None:
    step = ObjectStep(config, registered())
    assert step.silent(T0) == []
    step.step(openvr_pose(), T0 + 10**18)
    assert step.silent(T0 + 10**18 + 400 * MS) == []
    (lost,) = step.silent(T0 + 10**18 + 700 * MS)
    # A recording's stamps go on.
    assert (lost.object, lost.tracking, lost.stamp_ns) == ("cup", "lost", T0 + 700 * MS)


numbers = st.floats(allow_nan=True, allow_infinity=True)
stamps = st.integers(-3, 3).map(lambda n: T0 + n * 4 * MS) | st.integers(0, 2**63 - 1)


@given(
    st.lists(
        st.tuples(
            stamps,
            st.integers(0, 2**63 - 1),
            st.integers(-(2**62), 2**62),
            st.sampled_from([-1, 0, 2**62]),
            st.lists(numbers, min_size=3, max_size=3),
            st.sampled_from([200, 200, 201, 1]),
        ),
        max_size=30,
    )
)
def test_any_stream_gives_rising_stamps_and_messages_that_survive_the_wire(
    config: RigConfig, messages
) -> None:
    device = msgspec.structs.replace(openvr_pose().device, battery=math.nan)
    step = ObjectStep(config, registered())
    given_out = 0
    for k, (stamp_ns, seq, offset_ns, sigma_ns, (x, y, z), code) in enumerate(messages):
        pose = openvr_pose(
            [(1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z)],
            device=device,
            stamp_ns=stamp_ns,
            seq=seq,
            clock_offset_ns=offset_ns,
            clock_sigma_ns=sigma_ns,
            eTrackingResult=code,
        )
        result = step.step(pose, T0 + k * 4 * MS)
        step.faults(T0 + k * 4 * MS)
        step.silent(T0 + k * 4 * MS)
        if result is not None:
            given_out += 1
            assert msgspec.json.decode(msgspec.json.encode(result), type=ObjectPose) == result
            assert all(abs(value) <= 101.0 for value in result.position_m)
    left_out = sum(n for name, n in step.values().items() if name.startswith("left_out"))
    # A pose that disagrees for long is told as lost, and counted as left out all the same.
    assert given_out + left_out >= len(messages)
