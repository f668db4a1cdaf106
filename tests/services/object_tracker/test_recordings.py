"""ObjectStep on recordings of real trackers: SteamVR's and libsurvive's."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects as ObjectsTable
from rhot.geometry.transforms import angle_between, rotation_from_quaternion, transform
from services.object_tracker.step import ObjectStep
from testing.openvr_poses import openvr_pose, registered


def test_real_steamvr_drift_recording_is_all_rotations(config: RigConfig, vive: Path) -> None:
    """20 minutes of a still tracker, 3x4 rows (MarvinGravert/Vive-Accuracy-Experiment)."""
    recorded = np.loadtxt(vive / "marvin" / "drift20minExperiment.txt.gz").reshape(-1, 3, 4)
    exact = msgspec.structs.replace(config, objects=ObjectsTable(filter_mm=0.0))
    step = ObjectStep(exact, None)
    # 5 Hz.
    results = [
        step.step(openvr_pose(matrix, stamp_ns=10**18 + k * 2 * 10**9, seq=k))
        for k, matrix in enumerate(recorded[::10])
    ]
    assert step.lost == 0
    assert None not in results
    assert len(results) > 500
    worst = max(
        angle_between(matrix[:, :3], rotation_from_quaternion(result.orientation_wxyz))
        for matrix, result in zip(recorded[::10], results, strict=True)
        if result is not None
    )
    assert worst < 3e-6


def test_outliers_of_a_real_tracker_are_not_published(config: RigConfig, vive: Path) -> None:
    """Against the median of seven poses around each: what is off by 50 mm or more is an outlier."""
    unfiltered = msgspec.structs.replace(config, objects=ObjectsTable(filter_mm=0.0))
    name = vive / "libsurvive" / "poses_tracker-bad-tracking.csv.gz"
    # Seconds, position, quaternion.
    rows = np.genfromtxt(name, delimiter=",", skip_header=1, usecols=(0, *range(3, 10)))
    step = ObjectStep(unfiltered, registered())
    results = [
        step.step(
            openvr_pose(
                transform(rotation_from_quaternion(row[4:].tolist()), row[1:4]),
                seq=k,
                stamp_ns=10**18 + round(row[0] * 1e9),
            )
        )
        for k, row in enumerate(rows)
    ]
    positions = rows[:, 1:4]
    around = np.lib.stride_tricks.sliding_window_view(positions, 7, axis=0)  # (n - 6, 3, 7)
    off_m = np.linalg.norm(positions[3:-3] - np.median(around, axis=2), axis=1)
    outliers = np.flatnonzero(off_m > 0.05) + 3
    assert len(outliers) >= 3
    for k in outliers:
        result = results[k]
        assert result is None or result.tracking == "lost"
    # And the hand that moves at 3 m/s and turns at 35 rad/s is followed: 98 % come through.
    shown = sum(result is not None and result.tracking == "ok" for result in results)
    assert shown >= 0.98 * len(rows)
