"""The pose sources: a fake SteamVR, a survive-cli made of shell, real and broken files."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from rhot import clock
from rhot.errors import CaptureError, SourceError
from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources import PoseSource, open_source
from services.object_tracker.sources.libsurvive import LibSurvive
from services.object_tracker.sources.replay import Replay
from services.object_tracker.sources.steamvr import SteamVr, _Poller

MakePose = Callable[..., OpenVrPose]


async def take(source: PoseSource, count: int) -> list[OpenVrPose]:
    """The first poses of a source, at most `count`, within 10 s."""
    found: list[OpenVrPose] = []
    async with asyncio.timeout(10.0), contextlib.aclosing(source.poses()) as poses:
        async for pose in poses:
            found.append(pose)
            if len(found) == count:
                break
    return found


def is_running(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("steamvr", SteamVr),
        ("libsurvive", LibSurvive),
        ("replay:x.jsonl", Replay),
        ("simulator", type(None)),
        ("network", type(None)),
    ],
)
def test_names_of_sources(name: str, kind: type) -> None:
    assert isinstance(open_source(RigConfig(objects=Objects(source=name)), print), kind)


@pytest.mark.parametrize("name", ["stemvr", "replay", "replay:", "steamvr:1", ""])
def test_unknown_names_list_the_valid_ones(name: str) -> None:
    with pytest.raises(SourceError, match=r"valid: steamvr, libsurvive, replay:FILE"):
        open_source(RigConfig(objects=Objects(source=name)), print)


async def test_replay_keeps_order_stamps_and_pace(tmp_path: Path, make_pose: MakePose) -> None:
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
async def test_replay_of_broken_files(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "objects.jsonl"
    if text is not None:
        path.write_text(text)
    with pytest.raises(CaptureError, match=said):
        await take(Replay(path), 1)


async def test_libsurvive_lines_become_poses(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    script = f"""echo $$ > {pid_file}
echo 'INFO LOG something'
echo '0.1 WM0 CONFIG {{"device_serial_number": "LHR-1"}}'
echo '0.2 WM0 POSE 1 2 3 1 0 0 0'
echo '0.2 WM0 VELOCITY 1 0 0 0 0 0'
head -c 2000000 /dev/zero
echo
echo '0.3 WM0 POSE 1 2 4 1 0 0 0'
echo '0.4 WM0 W 1'
exec tail -f /dev/null"""
    first, second = await take(LibSurvive(("sh", "-c", script)), 2)
    assert (first.device.serial, first.vVelocity, first.seq) == ("LHR-1", (1.0, 0.0, 0.0), 0)
    assert (second.mDeviceToAbsoluteTracking[1][3], second.seq) == (4.0, 1)
    assert first.stamp_ns < second.stamp_ns <= clock.now_ns()
    assert not is_running(int(pid_file.read_text())), "the subprocess outlived its source"


async def test_libsurvive_ended_or_missing() -> None:
    with pytest.raises(SourceError, match="exit code 3"):
        await take(LibSurvive(("sh", "-c", "exit 3")), 1)
    with pytest.raises(SourceError, match="install libsurvive"):
        await take(LibSurvive(("no-such-survive-cli",)), 1)


async def test_steamvr_poses(fake_vr: SimpleNamespace) -> None:
    poses = await take(SteamVr(500.0, print), 3)
    assert [pose.seq for pose in poses] == [0, 1, 2]
    pose = poses[0]
    assert (pose.device.serial, pose.device.index, pose.device.device_class) == (
        "LHR-1",
        2,
        "GenericTracker",
    )
    assert pose.device.battery == -1.0  # a wired device has none to report
    assert [row[3] for row in pose.mDeviceToAbsoluteTracking] == [0.1, 0.2, 0.3]
    assert (pose.bPoseIsValid, pose.eTrackingResult, pose.vVelocity) == (True, 200, (0.1, 0.0, 0.0))
    assert fake_vr.closed == 1


async def test_steamvr_numbers_that_are_not_finite(fake_vr: SimpleNamespace) -> None:
    fake_vr.system.matrix = [[float("nan")] * 4] * 3
    (pose,) = await take(SteamVr(500.0, print), 1)
    assert not pose.bPoseIsValid
    assert pose.mDeviceToAbsoluteTracking == ((0.0,) * 4,) * 3


@pytest.mark.parametrize(
    ("serial", "name"),
    [("LHR/1 x", "LHR_1_x"), ("", "device2"), ("-odd", "device2"), ("x" * 99, "x" * 64)],
)
async def test_steamvr_serials_fit_into_keys(
    fake_vr: SimpleNamespace, serial: str, name: str
) -> None:
    fake_vr.system.serial = serial
    (pose,) = await take(SteamVr(500.0, print), 1)
    assert pose.device.serial == name


async def test_steamvr_moved_origin_is_reported_and_quitting_ends(fake_vr: SimpleNamespace) -> None:
    said: list[str] = []
    fake_vr.system.events = [801, 5, 808]
    poller = _Poller(said.append)
    poller.poll(0.0)
    assert len(said) == 2
    assert all("registration is stale" in text for text in said)
    fake_vr.system.events = [700]
    with pytest.raises(SourceError, match="SteamVR quit"):
        await take(SteamVr(500.0, print), 1)
    assert fake_vr.closed == 1


async def test_steamvr_missing(fake_vr: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(application: int) -> None:
        raise fake_vr.OpenVRError

    fake_vr.init = refuse
    with pytest.raises(
        SourceError, match=r"SteamVR cannot be reached \(FakeVrError\); install and start SteamVR"
    ):
        await take(SteamVr(90.0, print), 1)
    monkeypatch.setitem(sys.modules, "openvr", None)
    with pytest.raises(SourceError, match=r"rhot\[openvr\]"):
        await take(SteamVr(90.0, print), 1)


async def test_the_real_openvr_package_without_steamvr() -> None:
    pytest.importorskip("openvr", reason="PyPI openvr is not installed")
    with pytest.raises(SourceError, match=r"SteamVR cannot be reached \(InitError_"):
        await take(SteamVr(90.0, print), 1)
