"""The names of pose sources, and a fake SteamVR."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from rhot.errors import SourceError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources import PoseSource, open_source
from services.object_tracker.sources.libsurvive import LibSurvive, Playback
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


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("steamvr", SteamVr),
        ("libsurvive", LibSurvive),
        ("replay:x.jsonl", Replay),
        ("playback:x.rec.gz", Playback),
        ("simulator", type(None)),
        ("network", type(None)),
    ],
)
def test_names_of_sources(name: str, kind: type) -> None:
    assert isinstance(open_source(RigConfig(objects=Objects(source=name)), print), kind)


@pytest.mark.parametrize("name", ["stemvr", "replay", "replay:", "playback", "steamvr:1", ""])
def test_unknown_names_list_the_valid_ones(name: str) -> None:
    with pytest.raises(SourceError, match=r"valid: steamvr, libsurvive, replay:FILE"):
        open_source(RigConfig(objects=Objects(source=name)), print)


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
