"""`rhot calibrate stereo --live` against cameras on a real router.

The cameras answer `frame` queries with rendered pictures.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import cv2
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import BusError, CalibrationError
from rhot.files.config import RigConfig, load_rig
from services.calibrator.board.board import Board
from services.calibrator.endpoints import board_positions
from services.cli.calibrate.live_pictures import LiveCameras, collect, one_each
from testing.synthetic_boards import BenchSetup


@pytest.fixture
def rig(tmp_path, router) -> RigConfig:
    """A rig of two cameras at the router."""
    path = tmp_path / "rig.toml"
    path.write_text(
        f'[bus]\nconnect = ["{router}"]\n[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n'
    )
    return load_rig(path)


@pytest.fixture(scope="module")
def shown() -> dict[str, list[bytes]]:
    """PNGs of each camera, position by position."""
    bench = BenchSetup(
        positions=3, size_px=(320, 240), focal_px=263.0, distortion=(0.0,) * 5
    ).bench()
    pictures = {
        camera.name: [bench.picture(camera, key) for key in bench.poses] for camera in bench.cameras
    }
    return {
        name: [cv2.imencode(".png", picture)[1].tobytes() for picture in each]
        for name, each in pictures.items()
    }


@asynccontextmanager
async def cameras(
    router: str, shown: dict[str, list[bytes]], each: int = 4
) -> AsyncIterator[dict[str, int]]:
    """Cameras that show every position for so many takes, and count what they were asked for."""
    asked = dict.fromkeys(shown, 0)
    async with open_bus("desk", [router]) as bus:

        def answer(name: str) -> bytes:
            asked[name] += 1
            picture = shown[name][min((asked[name] - 1) // each, len(shown[name]) - 1)]
            # No two pictures of a camera are the same.
            return picture + asked[name].to_bytes(4)

        for name in shown:
            bus.answer(topics.FRAME, lambda name=name: answer(name), camera=name)
        yield asked


async def test_still_positions_are_kept_as_pictures(rig, router, shown, tmp_path):
    folder = tmp_path / "pictures"
    async with cameras(router, shown) as asked:
        board = await asyncio.to_thread(collect, LiveCameras(rig, [], folder), None, 0.025, 3)
    assert (board.cols, board.rows, board.square_m) == (9, 6, 0.025)
    assert sorted(path.name for path in folder.iterdir()) == [
        f"{name}_{n:02d}.png" for name in ("left", "right") for n in (1, 2, 3)
    ]
    assert (folder / "left_01.png").read_bytes()[:-4] == shown["left"][0]
    assert asked["left"] == asked["right"]


async def test_pictures_of_an_earlier_try_stay(rig, router, shown, tmp_path):
    (tmp_path / "left_07.png").write_bytes(b"earlier")
    async with cameras(router, shown):
        await asyncio.to_thread(collect, LiveCameras(rig, ["left"], tmp_path), None, 0.025, 1)
    assert (tmp_path / "left_07.png").read_bytes() == b"earlier"
    assert (tmp_path / "left_08.png").read_bytes()[:-4] == shown["left"][0]


async def test_a_camera_that_is_silent_is_named(rig, router, shown, tmp_path):
    async with cameras(router, {"left": shown["left"]}):
        with pytest.raises(BusError, match="camera right sends no picture"):
            await asyncio.to_thread(collect, LiveCameras(rig, [], tmp_path), None, 0.025, 3)


async def test_nobody_showing_anything_new_ends_it(rig, router, shown, tmp_path, monkeypatch):
    monkeypatch.setattr(board_positions, "_PATIENCE_S", 0.5)
    async with cameras(router, {name: pictures[:1] for name, pictures in shown.items()}):
        with pytest.raises(CalibrationError, match="nothing new was shown") as ended:
            await asyncio.to_thread(
                collect, LiveCameras(rig, [], tmp_path), Board(9, 6, 0.025), 0.025, 3
            )
    assert "/3 positions" in str(ended.value)
    assert str(tmp_path) in str(ended.value)


async def test_one_picture_each_for_the_desk(rig, router, shown, tmp_path):
    async with cameras(router, shown):
        await asyncio.to_thread(one_each, LiveCameras(rig, ["left", "right"], tmp_path))
    assert (tmp_path / "left.png").read_bytes()[:-4] == shown["left"][0]
    with pytest.raises(BusError, match="no camera of left, right answers"):
        await asyncio.to_thread(one_each, LiveCameras(rig, ["left", "right"], tmp_path))


async def test_an_unknown_camera_is_refused_before_anything_is_asked(rig, tmp_path):
    with pytest.raises(Exception, match="has no camera 'top'"):
        await asyncio.to_thread(collect, LiveCameras(rig, ["top"], tmp_path), None, 0.025, 3)
