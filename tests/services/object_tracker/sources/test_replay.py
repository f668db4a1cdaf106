"""Recordings played: pace, stamps, loops; broken files; real recordings."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from rhot import clock
from rhot.errors import CaptureError
from rhot.files.capture import write_lines
from services.object_tracker.sources.replay import Replay


async def test_replay_keeps_order_stamps_and_pace(tmp_path: Path, make_pose, take) -> None:
    path = tmp_path / "objects.jsonl"
    poses = [
        make_pose(stamp_ns=stamp)
        for stamp in (1_000_000_000, 1_040_000_000, 900_000_000, 940_000_000)
    ]
    write_lines(path, poses)
    start_s = asyncio.get_running_loop().time()
    assert await take(Replay(path), 9) == poses
    # 40 ms, backwards (at once), 40 ms.
    assert asyncio.get_running_loop().time() - start_s >= 0.079


@pytest.mark.parametrize(
    ("text", "said"), [(None, "cannot be read"), ("{}\n", "line 1"), ('{"v": 1', "line 1")]
)
async def test_replay_of_broken_files(tmp_path: Path, text: str | None, said: str, take) -> None:
    path = tmp_path / "objects.jsonl"
    if text is not None:
        path.write_text(text)
    with pytest.raises(CaptureError, match=said):
        await take(Replay(path), 1)


async def test_dates_are_kept_and_run_times_become_now(vive: Path, take) -> None:
    (first, *_) = await take(Replay(vive / "marvin" / "drift20minExperiment.txt.gz", "LHR-1"), 1)
    assert (first.stamp_ns, first.device.serial) == (1_601_642_451_000_000_000, "LHR-1")
    before_ns = clock.now_ns()
    path = vive / "libsurvive" / "poses_tracker-bad-tracking.csv.gz"
    poses = await take(Replay(path), 50)
    stamps = np.array([pose.stamp_ns for pose in poses])
    assert before_ns <= stamps[0] <= clock.now_ns()
    assert stamps[-1] <= clock.now_ns()
    assert np.median(np.diff(stamps)) == pytest.approx(8e6, rel=0.02)  # its own 125 Hz
    assert [pose.seq for pose in poses] == list(range(50))


async def test_faster_and_again(tmp_path: Path, make_pose, take) -> None:
    """Twice as fast, and begun anew at its end: stamps go on, velocities fit them."""
    path = tmp_path / "objects.jsonl"
    poses = [
        make_pose(stamp_ns=10**18 + i * 20_000_000, vVelocity=(float(i), 0.0, 0.0))
        for i in range(3)
    ]
    write_lines(path, poses)
    found = await take(Replay(path, speed=2.0, loop=True), 7)
    assert [pose.vVelocity[0] for pose in found] == [0.0, 2.0, 4.0] * 2 + [0.0]
    assert np.diff([pose.stamp_ns for pose in found]).tolist() == [10_000_000] * 6
