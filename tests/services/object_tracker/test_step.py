"""ObjectStep against closed forms, finite differences and everything an untrusted pose can be: one
pose at a time; streams of them are in test_streams.py.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.files.calibration import ObjectPlace, Objects
from rhot.files.config import RigConfig
from rhot.geometry.transforms import (
    Array,
    angle_between,
    apply,
    rotation_from_quaternion,
    rotation_from_vector,
    transform,
)
from rhot.messages.objects import ObjectPose, OpenVrPose
from services.object_tracker.intake.reading import TRACKING_RESULTS
from services.object_tracker.step import ObjectStep
from testing.openvr_poses import openvr_pose

OFFSET = (0.03, -0.05, 0.11)
TURN = (0.5, 0.5, -0.5, 0.5)
T_RIG_FROM_LIGHTHOUSE = transform(rotation_from_vector([0.3, -1.1, 2.0]), [0.4, -1.2, 2.3])


def objects(**places: ObjectPlace) -> Objects:
    rows = tuple(tuple(row) for row in T_RIG_FROM_LIGHTHOUSE.tolist())
    return Objects(T_rig_from_lighthouse=rows, objects=places)  # type: ignore[arg-type]


def calibrated(time_offset_ns: int = 0) -> Objects:
    return objects(
        cup=ObjectPlace(offset_m=OFFSET, orientation_wxyz=TURN, time_offset_ns=time_offset_ns)
    )


def step_one(config: RigConfig, file: Objects | None, pose: OpenVrPose) -> ObjectPose:
    result = ObjectStep(config, file).step(pose)
    assert result is not None
    return result


def test_chain_of_frames(config: RigConfig) -> None:
    T = transform(rotation_from_vector([-0.7, 0.2, 0.9]), [1.0, 1.5, -0.8])
    result = step_one(config, calibrated(), openvr_pose(T))
    assert (result.object, result.serial, result.seq, result.tracking, result.registered) == (
        "cup",
        "LHR-1",
        7,
        "ok",
        True,
    )
    np.testing.assert_allclose(
        result.position_m, apply(T_RIG_FROM_LIGHTHOUSE, apply(T, OFFSET)), atol=1e-6
    )
    R = T_RIG_FROM_LIGHTHOUSE[:3, :3] @ T[:3, :3] @ rotation_from_quaternion(TURN)
    assert angle_between(R, rotation_from_quaternion(result.orientation_wxyz)) < 3e-6


@pytest.mark.parametrize(
    "axis", np.vstack([np.eye(3), [[1, 1, 0], [0, -1, 1], [1, -2, 3]]]).tolist()
)
def test_orientation_at_180_deg(config: RigConfig, axis: list[float]) -> None:
    u = np.array(axis) / np.linalg.norm(axis)
    R = 2.0 * np.outer(u, u) - np.eye(3)
    result = step_one(config, None, openvr_pose(transform(R, [0.0, 0.0, 1.0])))
    assert angle_between(R, rotation_from_quaternion(result.orientation_wxyz)) < 3e-6
    assert result.orientation_wxyz[0] == 0.0


def test_velocities_agree_with_finite_differences(config: RigConfig) -> None:
    """A tracker that spins and flies: the published velocities are the derivatives of the published
    poses.
    """
    w, v, dt = np.array([1.2, -0.7, 2.1]), np.array([0.3, 0.5, -0.2]), 1e-3
    start = rotation_from_vector([0.4, 0.1, -0.6])

    def at(t: float) -> OpenVrPose:
        T = transform(rotation_from_vector(w * t) @ start, v * t + [0.1, 0.2, 0.3])
        return openvr_pose(T, vVelocity=tuple(v.tolist()), vAngularVelocity=tuple(w.tolist()))

    before, now, after = (step_one(config, calibrated(), at(t)) for t in (-dt, 0.0, dt))
    velocity = (np.array(after.position_m) - before.position_m) / (2 * dt)
    # Positions are rounded to 1e-6 m: 1e-6 / 1e-3 s.
    np.testing.assert_allclose(now.velocity_m_s, velocity, atol=1e-3)
    R_before, R_now, R_after = (
        rotation_from_quaternion(p.orientation_wxyz) for p in (before, now, after)
    )
    spin = (R_after - R_before) @ R_now.T / (2 * dt)
    angular = (
        np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]) / 2
    )
    np.testing.assert_allclose(now.angular_velocity_rad_s, angular, atol=4e-3)
    assert (
        np.linalg.norm(np.array(now.velocity_m_s) - T_RIG_FROM_LIGHTHOUSE[:3, :3] @ v) > 0.1
    )  # the lever arm matters


def test_object_without_a_place_is_its_tracker(config: RigConfig) -> None:
    result = step_one(config, objects(), openvr_pose(transform(np.eye(3), [0.1, 0.2, 0.3])))
    assert result.registered
    np.testing.assert_allclose(
        result.position_m, apply(T_RIG_FROM_LIGHTHOUSE, [0.1, 0.2, 0.3]), atol=1e-6
    )


@pytest.mark.parametrize(
    ("code", "tracking"),
    [
        (100, "calibrating"),
        (101, "calibrating"),
        (200, "unregistered"),
        (201, "out_of_range"),
        (300, "rotation_only"),
    ],
)
def test_tracking_results(config: RigConfig, code: int, tracking: str) -> None:
    result = step_one(
        config, None, openvr_pose(transform(np.eye(3), [1.0, 0.0, 0.0]), eTrackingResult=code)
    )
    assert (result.tracking, result.position_m) == (tracking, (1.0, 0.0, 0.0))


def rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


GOOD = np.eye(4)[:3]


def plus(row: list[float]) -> tuple[tuple[float, ...], ...]:
    """The identity pose with `row` added to each of its rows."""
    return rows(np.add(GOOD, row))


SAID_BY_THE_DEVICE = {
    "not valid": {"bPoseIsValid": False},
    "disconnected": {"bDeviceIsConnected": False},
    "uninitialized": {"eTrackingResult": 1},
}
MISREAD = {
    "version": {"v": 2},
    "result": {"eTrackingResult": 10**30},
    "position": {"mDeviceToAbsoluteTracking": plus([0, 0, 0, 1e300])},
    "rotation": {"mDeviceToAbsoluteTracking": rows(GOOD * 1.01)},
    "velocity": {"vVelocity": (math.nan, 0.0, 0.0)},
}
LATER_NS = 1_700_000_000_004_000_000


@pytest.mark.parametrize("state", SAID_BY_THE_DEVICE)
def test_a_device_that_says_so_is_lost_and_nothing_is_guessed(
    config: RigConfig, state: str
) -> None:
    step = ObjectStep(config, calibrated())
    step.step(openvr_pose(transform(np.eye(3), [1.0, 2.0, 3.0])))
    result = step.step(openvr_pose(stamp_ns=LATER_NS, **SAID_BY_THE_DEVICE[state]))
    assert result is not None
    assert (result.tracking, step.lost, result.sigma_m) == ("lost", 1, None)
    assert (result.position_m, result.orientation_wxyz) == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    assert result.velocity_m_s == result.angular_velocity_rad_s == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("reason", MISREAD)
def test_what_cannot_be_right_is_counted_and_never_published(
    config: RigConfig, reason: str
) -> None:
    step = ObjectStep(config, calibrated())
    assert step.step(openvr_pose(stamp_ns=LATER_NS, **MISREAD[reason])) is None
    assert step.values()[f"left_out_{reason}"] == 1
    (text,) = step.faults(LATER_NS)["device_misread"].values()
    assert "poses of LHR-1 are left out: 1 for their " + reason in text
    # It is over 5 s after the last one; what is right comes through meanwhile.
    assert step.step(openvr_pose(stamp_ns=LATER_NS + 1)) is not None
    assert not step.faults(LATER_NS + 5_000_000_001)["device_misread"]


def test_unknown_serials_are_ignored_counted_and_bounded(config: RigConfig) -> None:
    step = ObjectStep(config, None)
    for number in range(200):
        assert step.step(openvr_pose(serial=f"X{number}")) is None
    assert (step.unknown, len(step.unknown_serials)) == (200, 64)
    assert "X0" in step.unknown_serials


@pytest.mark.parametrize(
    ("offset_ns", "stamp_ns", "expected_ns"),
    [(5, 100, 95), (-5, 100, 105), (200, 100, 0), (-(10**30), 100, 2**63 - 1)],
)
def test_time_offset(config: RigConfig, offset_ns: int, stamp_ns: int, expected_ns: int) -> None:
    assert (
        step_one(config, calibrated(offset_ns), openvr_pose(stamp_ns=stamp_ns)).stamp_ns
        == expected_ns
    )


numbers = st.floats(allow_nan=True, allow_infinity=True)


@given(
    matrix=st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=3, max_size=3),
    speeds=st.tuples(st.tuples(numbers, numbers, numbers), st.tuples(numbers, numbers, numbers)),
    code=st.sampled_from([*TRACKING_RESULTS, 0, 2, -1, 10**30]),
)
def test_any_numbers_give_a_message_that_survives_the_wire(
    config: RigConfig,
    matrix: list[tuple[float, ...]],
    speeds: tuple[tuple[float, ...], ...],
    code: int,
) -> None:
    pose = openvr_pose(
        matrix,
        seq=0,
        stamp_ns=0,
        vVelocity=speeds[0],
        vAngularVelocity=speeds[1],
        eTrackingResult=code,
    )
    step = ObjectStep(config, calibrated())
    result = step.step(pose)
    if result is None:
        assert sum(step.values().values()) == 2.0  # registered, and one left out
        return
    assert msgspec.json.decode(msgspec.json.encode(result), type=ObjectPose) == result
