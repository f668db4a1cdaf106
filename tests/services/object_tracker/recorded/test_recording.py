"""Recordings of real lighthouses, each kind: how many poses, what they are, how still they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rhot.errors import CaptureError
from rhot.files.capture import write_lines
from rhot.geometry.transforms import Array, quaternion_from_rotation, rotation_from_quaternion
from rhot.messages.objects import OpenVrPose
from services.object_tracker.recorded.recording import kind_of, read_poses


def matrices(poses: list[OpenVrPose]) -> Array:
    return np.array([pose.mDeviceToAbsoluteTracking for pose in poses])  # (n, 3, 4)


def rms_mm(positions: Array) -> float:
    """RMS distance from their median."""
    offsets = positions - np.median(positions, axis=0)
    return float(np.sqrt((offsets**2).sum(axis=1).mean())) * 1e3


def test_still_tracker_of_libsurvive(vive: Path) -> None:
    """The still tracker, as libsurvive solved it afterwards: 0.044 mm RMS."""
    path = vive / "libsurvive" / "tracker-cal-attempt.rec.gz"
    poses = list(read_poses(path))
    assert kind_of(path) == "libsurvive"
    assert len(poses) == 4407
    assert {pose.device.serial for pose in poses} == {"LHR-BAB3D7B1"}
    positions = matrices(poses)[:, :, 3]
    assert rms_mm(positions) == pytest.approx(0.044, abs=0.001)
    # As it computed them live (EXTERNAL_POSE), it jumps by up to 43 mm while it finds the
    # lighthouses.
    both = list(read_poses(vive / "libsurvive" / "poses_tracker-cal-attempt.csv.gz"))
    again = [pose for pose in both if pose.device.serial == "WM0"]
    live = matrices([pose for pose in both if pose.device.serial == "replay_WM0"])[:, :, 3]
    assert (len(again), len(live)) == (4407, 7567)
    np.testing.assert_allclose(matrices(again), matrices(poses), atol=1e-9)
    assert rms_mm(live) == pytest.approx(1.459, abs=0.01)
    assert np.linalg.norm(live - np.median(live, axis=0), axis=1).max() == pytest.approx(
        0.0433, abs=1e-4
    )


def test_bad_tracking_of_libsurvive(vive: Path) -> None:
    """A tracker that is moved, tracked badly: from one pose to the next (8 ms) up to 224 mm."""
    poses = list(read_poses(vive / "libsurvive" / "poses_tracker-bad-tracking.csv.gz"))
    assert len(poses) == 3351
    assert all(pose.bPoseIsValid for pose in poses)
    steps_mm = np.linalg.norm(np.diff(matrices(poses)[:, :, 3], axis=0), axis=1) * 1e3
    assert steps_mm.max() == pytest.approx(224.2, abs=0.1)
    assert int((steps_mm > 100.0).sum()) == 4
    assert 1e-9 * (poses[-1].stamp_ns - poses[0].stamp_ns) == pytest.approx(25.13, abs=0.01)


def test_twenty_minutes_of_openvr_rows(vive: Path) -> None:
    """marvin's drift log: 6001 poses at 5 Hz, from its date on; matrices stay as written."""
    poses = list(read_poses(vive / "marvin" / "drift20minExperiment.txt.gz", "LHR-1"))
    assert len(poses) == 6001
    assert {pose.device.serial for pose in poses} == {"LHR-1"}
    # 2020-10-02 12:40:51
    assert poses[0].stamp_ns == 1_601_642_451_000_000_000
    assert poses[-1].stamp_ns - poses[0].stamp_ns == 1200 * 10**9
    assert poses[0].mDeviceToAbsoluteTracking[2] == (
        -0.9628813862800598,
        -0.26947706937789917,
        0.015536907128989697,
        -2.478436231613159,
    )
    positions = matrices(poses)[:, :, 3]
    minutes = positions[:6000].reshape(20, 300, 3).mean(axis=1)
    drift_mm = np.linalg.norm(minutes - minutes[0], axis=1) * 1e3
    # Away by 1 mm in its middle, and back: a mean over the last minute would not tell.
    assert drift_mm.max() == pytest.approx(1.01, abs=0.1)
    assert drift_mm[-1] == pytest.approx(0.31, abs=0.01)


def test_points_of_marvin(vive: Path) -> None:
    """Each of the 11 points: 1001 rows of get_pose_quaternion, still within 0.7 mm RMS."""
    folder = vive / "marvin" / "20200827_Exp1"
    stillness = []
    for point in range(1, 12):
        poses = list(read_poses(folder / f"measurementPoint{point}.txt"))
        assert len(poses) == 1001
        assert all(pose.bPoseIsValid for pose in poses)
        assert poses[-1].stamp_ns - poses[0].stamp_ns == 4 * 10**9  # 250 Hz
        stillness.append(rms_mm(matrices(poses)[:, :, 3]))
    assert max(stillness) == pytest.approx(0.692, abs=0.001)
    assert min(stillness) < 0.1
    # The row's own numbers: x y z w x y z, although its header says `w j i k`.
    first = next(iter(read_poses(folder / "measurementPoint1.txt")))
    rows = np.array(first.mDeviceToAbsoluteTracking)
    np.testing.assert_allclose(
        quaternion_from_rotation(rows[:, :3]),
        [0.682377837, 0.670880429, -0.215785013, 0.194207992],
        atol=1e-6,
    )


def test_messages_and_a_folder_of_them(tmp_path: Path, make_pose) -> None:
    poses = [make_pose(stamp_ns=1_000 + i) for i in range(3)]
    write_lines(tmp_path / "objects.jsonl", poses)
    assert kind_of(tmp_path) == "messages"
    assert list(read_poses(tmp_path)) == poses
    # By content, not by name.
    other = (tmp_path / "objects.jsonl").rename(tmp_path / "x.txt")
    assert list(read_poses(other)) == poses
    with pytest.raises(CaptureError, match=r"no objects\.jsonl"):
        kind_of(tmp_path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no poses in it"),
        (b"\x89MCAP0\r\n....", "an MCAP recording: `rhot replay` plays it"),
        (b"some text\n" * 200, "line 100: not a pose"),
        (b"a" * (1 << 21), "line 1: longer than"),
        (b"\x1f\x8b\x08\x00garbage", "cannot be read after line 0|ends inside"),
        (b"0.001988 INFO LOG x\n0.1 WM0 W 1\n", 'no POSE lines.*source = "playback:x.rec"'),
    ],
)
def test_what_is_no_recording(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "x.rec"
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=said):
        list(read_poses(path))


def test_a_gzip_file_that_is_cut_off_gives_what_it_has(tmp_path: Path, vive: Path) -> None:
    whole = (vive / "libsurvive" / "tracker-cal-attempt.rec.gz").read_bytes()
    path = tmp_path / "cut.rec.gz"
    path.write_bytes(whole[: len(whole) * 3 // 4])
    found = []
    with pytest.raises(CaptureError, match="ends inside its compressed data"):
        found.extend(read_poses(path))
    assert 1000 < len(found) < 4407


def test_half_turns_are_exact(tmp_path: Path) -> None:
    """Half turns about axes of any direction, as 3x4 rows and as quaternions: to 1e-15."""
    axes = np.random.default_rng(3).normal(size=(50, 3))
    axes = np.vstack([np.eye(3), axes / np.linalg.norm(axes, axis=1, keepdims=True)])
    turns = [rotation_from_quaternion([0.0, *axis]) for axis in axes]
    path = tmp_path / "half.txt"
    rows = [np.column_stack([R, [0.1, 0.2, 0.3]]).ravel() for R in turns]
    path.write_text("\n".join(" ".join(map(repr, row.tolist())) for row in rows))
    for pose, R in zip(read_poses(path), turns, strict=True):
        assert np.array_equal(np.array(pose.mDeviceToAbsoluteTracking)[:, :3], R)
    path.write_text("\n".join(f"0 0 0 0 {x!r} {y!r} {z!r}" for x, y, z in axes.tolist()))
    for pose, R in zip(read_poses(path), turns, strict=True):
        found = np.array(pose.mDeviceToAbsoluteTracking)[:, :3]
        assert np.abs(found - R).max() < 1e-15
        np.testing.assert_allclose(rotation_from_quaternion(quaternion_from_rotation(found)), R)
