"""The survive-cli parser on a real recording, against poses that others took from it, and on
garbage.
"""

from __future__ import annotations

import csv
import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.geometry.transforms import rotation_from_quaternion
from services.object_tracker.survive_lines import RunClock, SurviveParser, SurvivePose, openvr_pose


def read(lines: list[str]) -> list[SurvivePose]:
    parser = SurviveParser()
    poses = [pose for line in lines if (pose := parser.feed(line)) is not None]
    last = parser.flush()
    return poses + ([last] if last else [])


def test_real_recording(vive: Path) -> None:
    """Every POSE line of a real recording, equal to the CSV taken from it, under the tracker's own
    serial number.
    """
    parser = SurviveParser()
    with gzip.open(
        vive / "libsurvive" / "tracker-cal-attempt.rec.gz", "rt", encoding="utf-8", errors="replace"
    ) as file:
        poses = [pose for line in file if (pose := parser.feed(line)) is not None]
    with gzip.open(vive / "libsurvive" / "poses_tracker-cal-attempt.csv.gz", "rt") as file:
        expected = [row for row in csv.DictReader(file) if row["kind"] == "POSE"]
    assert poses.pop().tracking == "gone"  # its last line of the device: DISCONNECT
    assert len(poses) == len(expected) == 4407
    assert parser.malformed == 0
    assert {pose.serial for pose in poses} == {"LHR-BAB3D7B1"}
    assert {pose.device for pose in poses} == {"WM0"}
    ours = np.array([[p.time_s, *p.position_m, *p.orientation_wxyz] for p in poses])
    columns = ("t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
    np.testing.assert_allclose(
        ours, [[float(row[c]) for c in columns] for row in expected], atol=1e-6
    )
    # 4354 of them came with a velocity; a tracker at rest has one of some um/s.
    assert sum(any(pose.velocity_m_s) for pose in poses) > 4000
    assert max(np.abs(pose.velocity_m_s).max() for pose in poses) < 0.01


def test_velocity_belongs_to_the_pose_before_it() -> None:
    first, second = read(
        [
            "1.5 WM0 POSE 1 2 3 1 0 0 0",
            "1.5 WM0 VELOCITY 0.1 0.2 0.3 4 5 6",
            "1.6 WM0 POSE 1 2 4 1 0 0 0",
            "1.7 WM0 VELOCITY 9 9 9 9 9 9",
        ]
    )
    # As libsurvive prints it live: a little later.
    (live,) = read(["3.809800 SM0 POSE 1 2 3 1 0 0 0", "3.809828 SM0 VELOCITY 1 0 0 0 0 0"])
    assert live.velocity_m_s == (1.0, 0.0, 0.0)
    assert (first.velocity_m_s, first.angular_velocity_rad_s) == ((0.1, 0.2, 0.3), (4.0, 5.0, 6.0))
    assert second.velocity_m_s == (0.0, 0.0, 0.0)  # of another instant


def test_a_pose_is_given_at_the_next_line_of_any_kind() -> None:
    parser = SurviveParser()
    assert parser.feed("1.0 WM0 POSE 1 2 3 1 0 0 0") is None
    assert parser.feed("1.0 T20 POSE 1 2 3 1 0 0 0").device == "WM0"  # type: ignore[union-attr]
    assert parser.feed("1.0 WM0 VELOCITY 1 1 1 1 1 1").device == "T20"  # type: ignore[union-attr]


def test_the_universe_is_where_the_lighthouses_are() -> None:
    """One name for one calibration, however often it is printed; another one after the next."""
    parser = SurviveParser()
    assert parser.universe == "libsurvive"
    names = []
    for line in (
        "0.1 0 LH_POSE -3.0 0.0 1.0 -0.707107 0.0 0.707107 0.0  1",
        "0.1 1 LH_POSE 3.0 0.0 1.0 0.707107 0.0 0.707107 0.0  2\r\n",
        "9.1 0 LH_POSE -3.0 0.0 1.0 -0.707107 0.0 0.707107 0.0  1",
        "9.2 ../x LH_POSE -3.0 0.0 1.1 -0.707107 0.0 0.707107 0.0  1",
        "9.3 0 LH_POSE -3.0 0.0 1.1 -0.707107 0.0 0.707107 0.0  1",
    ):
        parser.feed(line)
        names.append(parser.universe)
    first, both, again, other, moved = names
    assert first != both == again == other != moved
    assert re.fullmatch(r"libsurvive:[0-9a-f]{8}", both)


def test_a_device_that_is_gone() -> None:
    """Its pose before comes out first; its serial stays; a message of it is no valid pose."""
    pose, gone = read(
        [
            '0.1 WM0 CONFIG {"device_serial_number": "LHR-1"}',
            "1.5 WM0 POSE 1 2 3 1 0 0 0",
            "1.6 WM0 DISCONNECT\r\n",
            "1.6 WM0 VELOCITY 1 2 3 4 5 6",
        ]
    )
    assert (pose.tracking, gone.tracking, gone.serial, gone.time_s) == ("ok", "gone", "LHR-1", 1.6)
    assert gone.velocity_m_s == (0.0, 0.0, 0.0)
    message = openvr_pose(gone, 0, 0)
    assert not message.bPoseIsValid
    assert not message.bDeviceIsConnected
    assert read(["x WM0 DISCONNECT", "-1 WM0 DISCONNECT", "1 ../W DISCONNECT"]) == []


@pytest.mark.parametrize(
    "line",
    [
        "1.0 WM0 POSE 1 2 3 1 0 0",
        "1.0 WM0 POSE 1 2 3 1 0 0 0 0",
        "1.0 WM0 POSE 1 2 nan 1 0 0 0",
        "1.0 WM0 POSE 1 2 inf 1 0 0 0",
        "1.0 WM0 POSE 1 2 3 0 0 0 0",
        "1.0 WM0 POSE 1 2 3 1e300 1e300 0 0",
        "1.0 WM0 POSE a b c d e f g",
        "-1.0 WM0 POSE 1 2 3 1 0 0 0",
        "x WM0 POSE 1 2 3 1 0 0 0",
        "1.0 ../WM0 POSE 1 2 3 1 0 0 0",
    ],
)
def test_malformed_poses_are_counted_and_skipped(line: str) -> None:
    parser = SurviveParser()
    assert parser.feed(line) is None
    assert parser.flush() is None
    assert parser.malformed == 1


@given(
    st.lists(
        st.text() | st.from_regex(r"\d W POSE( -?\d){7}|\d W VELOCITY.*|1 \w CONFIG .*"),
        max_size=20,
    )
)
def test_no_line_breaks_it(lines: list[str]) -> None:
    for pose in read(lines):
        openvr_pose(pose, 0, 0)


def test_z_up_becomes_y_up() -> None:
    pose = SurvivePose(
        0.0,
        "WM0",
        "LHR-1",
        (1.0, 2.0, 3.0),
        (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)),
        (0.1, 0.2, 0.3),
        (0.0, 0.0, 1.0),
    )
    message = openvr_pose(pose, 4, 5)
    rows = np.array(message.mDeviceToAbsoluteTracking)
    np.testing.assert_allclose(rows[:, 3], [1.0, 3.0, -2.0])
    np.testing.assert_allclose(message.vVelocity, [0.1, 0.3, -0.2])
    # A turn about survive's up is a turn about OpenVR's up.
    np.testing.assert_allclose(message.vAngularVelocity, [0.0, 1.0, 0.0])
    R = rotation_from_quaternion(pose.orientation_wxyz)
    np.testing.assert_allclose(rows[:, :3] @ R.T @ [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], atol=1e-12)
    assert np.linalg.det(rows[:, :3]) == pytest.approx(1.0)
    assert (message.device.serial, message.seq, message.stamp_ns, message.universe) == (
        "LHR-1",
        4,
        5,
        "libsurvive",
    )


def test_run_clock_removes_delay_and_follows_drift() -> None:
    """Lines 0-20 ms late on a clock 50 ppm fast: stamps within 1.5 ms, arrivals scatter by 20."""
    rng = np.random.default_rng(1)
    clock, start_ns = RunClock(), 1_700_000_000_000_000_000
    errors = []
    for i in range(6000):
        true_ns = start_ns + i * 10_000_000
        stamp_ns = clock.stamp_ns(i * 0.01 * (1 + 50e-6), true_ns + int(rng.uniform(0, 20e6)))
        errors.append(stamp_ns - true_ns)
    assert np.abs(errors[200:]).max() < 1.5e6


def test_run_clock_follows_a_clock_that_was_set() -> None:
    clock = RunClock()
    assert clock.stamp_ns(1.0, 100_000_000_000) == 100_000_000_000
    assert clock.stamp_ns(2.0, 51_000_000_000) == 51_000_000_000
    assert clock.stamp_ns(3.0, 9_052_000_000_000) == 9_052_000_000_000
    assert clock.stamp_ns(1e300, 0) >= 0
