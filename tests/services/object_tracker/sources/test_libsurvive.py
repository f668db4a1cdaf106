"""survive-cli as a source: made of shell for every way to fail, and the real libsurvive with its
own simulator.
"""

from __future__ import annotations

import gzip
import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from rhot import clock
from rhot.errors import SourceError
from services.object_tracker.sources.libsurvive import LibSurvive, Playback
from services.object_tracker.sources.survive_command import survive_command, survive_library


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


def shell(script: str, silent_s: float = 30.0) -> LibSurvive:
    return LibSurvive(command=("sh", "-c", script), silent_s=silent_s)


async def test_lines_become_poses(tmp_path: Path, take) -> None:
    pid_file = tmp_path / "pid"
    script = f"""echo $$ > {pid_file}
echo '0.01 INFO LOG something'
echo '0.1 WM0 CONFIG {{"device_serial_number": "LHR-1"}}'
echo '0.2 WM0 POSE 1 2 3 1 0 0 0'
echo '0.2 WM0 VELOCITY 1 0 0 0 0 0'
head -c 2000000 /dev/zero
echo '0.25 WM0 POSE 9 9 9 1 0 0 0'
head -c 100000 /dev/urandom
echo
echo '0.3 WM0 POSE 1 2 4 1 0 0 0'
exec tail -f /dev/null"""
    first, second = await take(shell(script), 2)
    assert (first.device.serial, first.vVelocity, first.seq) == ("LHR-1", (1.0, 0.0, 0.0), 0)
    assert (second.mDeviceToAbsoluteTracking[1][3], second.seq) == (4.0, 1)
    assert first.stamp_ns < second.stamp_ns <= clock.now_ns()
    assert not is_running(int(pid_file.read_text())), "the subprocess outlived its source"


async def test_a_device_that_vanishes_is_told(take) -> None:
    """Lost when it has no pose for a while, gone when it is unplugged; each once."""
    script = """echo '0.2 WM0 POSE 1 2 3 1 0 0 0'
echo '0.2 T20 POSE 1 2 3 1 0 0 0'
echo '0.3 T20 DISCONNECT'
echo '0.39 WM0 I 3 1'
sleep 0.3
echo '0.41 WM0 I 3 2'
exec tail -f /dev/null"""
    poses = await take(shell(script), 4)
    told = [(p.device.serial, p.bPoseIsValid, p.bDeviceIsConnected) for p in poses]
    assert told == [
        ("WM0", True, True),
        ("T20", True, True),
        ("T20", False, False),
        ("WM0", False, True),
    ]
    assert [pose.eTrackingResult for pose in poses] == [200, 200, 201, 201]
    # Of each device: what comes late on a busy machine shifts the others.
    for serial in ("WM0", "T20"):
        stamps = [pose.stamp_ns for pose in poses if pose.device.serial == serial]
        assert stamps == sorted(stamps)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("exit 3", "ended with exit code 3; it said: nothing"),
        ("echo no USB access >&2; exit 1", "exit code 1; it said: no USB access"),
        ("echo '0.1 INFO LOG no lighthouse seen'; exit 0", "ended; it said: no lighthouse seen"),
        ("kill -SEGV $$", "was ended by SIGSEGV"),
        ("yes garbage | head -n 100000 >&2; exit 5", "it said: garbage; garbage; garbage"),
        ("head -c 3000000 /dev/urandom", "ended; it said"),
    ],
)
async def test_its_end_is_told_with_its_last_words(script: str, said: str, take) -> None:
    with pytest.raises(SourceError, match=said):
        await take(shell(script), 1)


async def test_one_that_hangs_is_ended(tmp_path: Path, take) -> None:
    """A program that prints nothing more, and ignores SIGTERM."""
    pid_file = tmp_path / "pid"
    script = f"""trap '' TERM
echo $$ > {pid_file}
while true; do sleep 0.1; done"""
    with pytest.raises(SourceError, match=r"has printed nothing for 0\.5 s"):
        await take(shell(script, silent_s=0.5), 1)
    assert not is_running(int(pid_file.read_text()))


async def test_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, take) -> None:
    with pytest.raises(SourceError, match=r"cannot start no-such-survive-cli: .*install lib"):
        await take(LibSurvive(command=("no-such-survive-cli",)), 1)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    with pytest.raises(SourceError, match="there is no survive-cli on the PATH; install libsurviv"):
        await take(LibSurvive(), 1)
    with pytest.raises(SourceError, match="there is no file"):
        await take(Playback(tmp_path / "x.rec.gz"), 1)
    program = tmp_path / "survive-cli"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert survive_command() == (str(program),)


async def test_simulated_tracker_of_the_real_libsurvive(simulated: list[str], take) -> None:
    """Half a second after its start libsurvive has solved where its own simulated tracker is."""
    told = await take(LibSurvive(simulated), 300)
    assert {pose.device.serial for pose in told} == {"SM0"}
    assert {pose.universe for pose in told} == {told[0].universe} != {"libsurvive"}
    # On a machine with much else to do its simulator halts, and its tracker is lost meanwhile; and
    # the clocks' offset may be found late.
    assert np.mean(np.diff([pose.stamp_ns for pose in told]) > 0) > 0.95
    poses = [pose for pose in told if pose.bPoseIsValid]
    assert len(poses) > 200
    rows = np.array([pose.mDeviceToAbsoluteTracking for pose in poses])
    R = rows[:, :, :3]
    assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 1e-5
    # For its first 2 s the simulated tracker lies at the origin; then it flies, at some 0.5 m/s.
    assert np.abs(np.median(rows[:50, :, 3], axis=0)).max() < 0.01
    speeds = np.linalg.norm([pose.vVelocity for pose in poses[-50:]], axis=1)
    assert np.median(speeds) > 0.1


async def test_crash_of_the_real_libsurvive(simulated: list[str], tmp_path: Path, take) -> None:
    """libsurvive's simulator without lighthouses in its configuration: a null pointer (1.1.21)."""
    if survive_library() is None or survive_command()[0] != sys.executable:
        pytest.skip("another libsurvive than pysurvive's may have mended it")
    empty = [*simulated[:-1], str(tmp_path / "empty.json")]
    with pytest.raises(SourceError, match=r"was ended by SIGSEGV; it said: .*Simulator"):
        await take(LibSurvive(empty), 1)


async def test_playback_by_the_real_libsurvive(
    simulated: list[str], tmp_path: Path, take, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It records its simulator, with motion, and solves the recording again."""
    path = tmp_path / "simulated.rec.gz"
    record = ["--record", str(path), "--record-cal-imu", "--record-angle", "--simulator-time", "3"]
    with pytest.raises(SourceError, match="ended"):
        await take(LibSurvive([*simulated, *record]), 10_000)
    poses = await take(Playback(path, simulated[-2:]), 10_000)
    assert sum(pose.bPoseIsValid for pose in poses) > 100
    assert not poses[-1].bDeviceIsConnected  # the end of the recording unplugs it


async def test_playback_of_a_recording_without_motion(
    simulated: list[str], vive: Path, tmp_path: Path, take
) -> None:
    """The still tracker's file keeps light and poses, but no motion: libsurvive solves nothing."""
    start = tmp_path / "start.rec"
    with gzip.open(vive / "libsurvive" / "tracker-cal-attempt.rec.gz", "rb") as whole:
        start.write_bytes(b"".join(itertools.islice(whole, 3000)))
    with pytest.raises(SourceError, match=r"computed no pose .* it needs light and motion"):
        await take(Playback(start, ["--configfile", str(tmp_path / "c.json")]), 10)
