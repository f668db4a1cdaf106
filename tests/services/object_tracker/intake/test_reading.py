"""Strict reading: everything an untrusted pose can be, and every result code of openvr.h."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_from_vector
from rhot.messages.objects import OpenVrPose
from services.object_tracker.intake.reading import (
    LOST,
    TRACKING_RESULTS,
    Reading,
    _is_rotation,
    read,
)

MakePose = Callable[..., OpenVrPose]
GOOD = np.eye(4)[:3]
GOLDEN = Path(__file__).parents[2] / "openvr_bridge" / "golden" / "messages.json"


def rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def plus(row: list[float]) -> tuple[tuple[float, ...], ...]:
    """The identity pose with `row` added to each of its rows."""
    return rows(np.add(GOOD, row))


MISREAD = {
    "older version": ("version", {"v": 0}),
    "newer version": ("version", {"v": 2}),
    "result 0": ("result", {"eTrackingResult": 0}),
    "result 202": ("result", {"eTrackingResult": 202}),
    "NaN position": ("position", {"mDeviceToAbsoluteTracking": plus([0, 0, 0, math.nan])}),
    "absurd position": ("position", {"mDeviceToAbsoluteTracking": plus([0, 0, 0, 1e300])}),
    "101 m": ("position", {"mDeviceToAbsoluteTracking": plus([0, 0, 0, -101.0])}),
    "infinite rotation": ("rotation", {"mDeviceToAbsoluteTracking": plus([math.inf, 0, 0, 0])}),
    "absurd rotation": ("rotation", {"mDeviceToAbsoluteTracking": rows(GOOD * 1e300)}),
    "mirror": ("rotation", {"mDeviceToAbsoluteTracking": rows(GOOD * [[1], [1], [-1]])}),
    "scaled": ("rotation", {"mDeviceToAbsoluteTracking": rows(GOOD * 1.01)}),
    "sheared": ("rotation", {"mDeviceToAbsoluteTracking": plus([0, 0.01, 0, 0])}),
    "all zero": ("rotation", {"mDeviceToAbsoluteTracking": rows(0 * GOOD)}),
    "NaN velocity": ("velocity", {"vVelocity": (math.nan, 0.0, 0.0)}),
    "absurd velocity": ("velocity", {"vAngularVelocity": (0.0, 1e300, 0.0)}),
}


@pytest.mark.parametrize("name", MISREAD)
def test_what_cannot_be_right_has_its_reason(make_pose: MakePose, name: str) -> None:
    reason, fields = MISREAD[name]
    assert read(make_pose(**fields)) == reason


@pytest.mark.parametrize(
    ("code", "tracking"),
    [
        (1, "lost"),
        (100, "calibrating"),
        (101, "calibrating"),
        (200, "ok"),
        (201, "out_of_range"),
        (300, "rotation_only"),
    ],
)
def test_every_result_code(make_pose: MakePose, code: int, tracking: str) -> None:
    reading = read(make_pose(eTrackingResult=code))
    assert isinstance(reading, Reading)
    assert reading.tracking == tracking


@pytest.mark.parametrize("fields", [{"bPoseIsValid": False}, {"bDeviceIsConnected": False}])
def test_the_numbers_of_a_lost_pose_are_not_looked_at(make_pose: MakePose, fields: dict) -> None:
    garbage = plus([math.nan, math.inf, 0, 1e300])
    assert read(make_pose(mDeviceToAbsoluteTracking=garbage, **fields)) is LOST


def test_five_digits_of_a_rotation_are_one(make_pose: MakePose) -> None:
    R = rotation_from_vector([0.3, -2.0, 1.1])
    typed = np.hstack([np.round(R, 5), [[1.0], [2.0], [3.0]]])
    reading = read(make_pose(mDeviceToAbsoluteTracking=rows(typed)))
    assert isinstance(reading, Reading)
    np.testing.assert_allclose(rotation_from_quaternion(reading.orientation_wxyz), R, atol=2e-5)
    assert reading.position_m == (1.0, 2.0, 3.0)


def test_golden_messages_of_the_bridge() -> None:
    """Made from the binding's own ctypes structs, for every ETrackingResult and device class."""
    golden = msgspec.json.decode(GOLDEN.read_bytes(), type=dict[str, dict | None])
    poses = {
        name: msgspec.convert(message, OpenVrPose)
        for name, message in golden.items()
        if message and "eTrackingResult" in message
    }
    assert {pose.eTrackingResult for pose in poses.values()} == set(TRACKING_RESULTS)
    for name, pose in poses.items():
        reading = read(pose)
        assert isinstance(reading, Reading), f"{name}: {reading}"
        known = pose.bPoseIsValid and pose.bDeviceIsConnected
        assert reading.tracking == (TRACKING_RESULTS[pose.eTrackingResult] if known else "lost")


@given(st.lists(st.floats(-2.0, 2.0), min_size=9, max_size=9))
def test_agrees_with_the_matrix_product(values: list[float]) -> None:
    R = np.array(values).reshape(3, 3)
    expected = np.abs(R @ R.T - np.eye(3)).max() <= 1e-3 and np.linalg.det(R) > 0.0
    assert _is_rotation(*values) == expected


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=9, max_size=9))
def test_no_number_raises(values: list[float]) -> None:
    assert _is_rotation(*values) in (True, False)
