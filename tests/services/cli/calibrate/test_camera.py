"""`rhot calibrate camera` and `rhot calibrate colors`, on recordings and on a running tracker."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading

import cv2
import numpy as np
import pytest
import uvloop
from typer.testing import CliRunner

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import BusError, CalibrationError, CaptureError, RefusedError
from rhot.files.calibration import ColorRange, Colors, load_colors, save
from rhot.files.config import load_rig
from rhot.messages import Session
from rhot.messages.simulator import SimFrame
from rhot.process.service import Service
from services.cli.application import application
from services.pi_tracker.service import serve
from testing.synthetic_images import Tip, clean, frame_of, noisy

SIZE = (240, 160)
TIPS = [
    Tip("green", 70.0, 80.0, width_px=14.0, length_px=16.0),
    Tip("blue", 130.0, 70.0, width_px=14.0, length_px=16.0),
]
RIG = (
    '[rig]\nname = "desk"\n'
    '[[camera]]\nname = "left"\nsource = "simulator"\nsize_px = [240, 160]\n'
    '[hand.right.markers]\nindex_tip = "green"\nthumb_tip = "blue"\n'
)


@pytest.fixture(scope="module")
def shot():
    """A picture of two tips without noise, and where they are."""
    return clean(TIPS, SIZE)


@pytest.fixture
def pictures(shot, tmp_path):
    """A folder of five pictures."""
    folder = tmp_path / "shots"
    folder.mkdir()
    for seq in range(5):
        cv2.imwrite(str(folder / f"{seq}.png"), noisy(shot[0], 5.0, seq))
    return folder


def rhot(*words):
    """Run the command; raises what it would say."""
    result = CliRunner().invoke(
        application(), ["calibrate", *map(str, words)], catch_exceptions=True
    )
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def places(shot, option):
    half = 12
    for color, (x, y) in shot[1].items():
        yield option
        yield (
            f"{color}={x:.0f},{y:.0f}"
            if option == "--click"
            else f"{color}={x - half:.0f},{y - half:.0f},{2 * half},{2 * half}"
        )


@pytest.mark.parametrize("option", ["--box", "--click"])
def test_a_recording_gives_a_file_with_date_tool_and_statistics(shot, pictures, tmp_path, option):
    words = ["--frames", "0,2,4", *places(shot, option), "--out", tmp_path / "cal"]
    result = rhot("colors", "cam", "--video", pictures, *words)
    made = load_colors(tmp_path / "cal", "cam")
    assert set(made.colors) == {"green", "blue"}
    assert made.date
    assert made.tool == "rhot calibrate colors"
    assert made.inputs["frames"] == [0, 2, 4]
    assert made.residuals["colors"]["green"]["pictures"] == 3
    assert made.residuals["separation"]["blue/green"]["d"] > 4.0
    assert "nearest" in result.stdout
    assert "written:" in result.stderr


def test_other_colours_in_the_file_stay(shot, pictures, tmp_path):
    other = ColorRange(hsv_low=(150, 100, 40), hsv_high=(165, 255, 255))
    save(tmp_path / "cam.colors.json", Colors(colors={"pink": other, "green": other}))
    (x, y) = shot[1]["green"]
    at = f"1:green={x:.0f},{y:.0f}"
    rhot("colors", "cam", "--video", pictures, "--at", at, "--out", tmp_path)
    made = load_colors(tmp_path, "cam").colors
    assert made["pink"] == other
    assert made["green"] != other


def test_auto_proposes_names_fits_and_draws(pictures, tmp_path):
    (tmp_path / "rig.toml").write_text(RIG)
    shown = tmp_path / "seen.png"
    words = ["--config", tmp_path / "rig.toml", "--picture", shown, "--json"]
    result = rhot("colors", "left", "--video", pictures, "--auto", *words)
    assert set(load_colors(tmp_path / "calibration", "left").colors) == {"green", "blue"}
    assert set(json.loads(result.stdout)["colors"]) == {"green", "blue"}
    assert "further paints that would stand out" in result.stderr
    picture = cv2.imread(str(shown))
    assert picture.shape == (5 * SIZE[1], SIZE[0], 3)
    # The tips are painted over in white.
    assert np.all(picture[80, 70] > 240)


def test_a_dry_run_writes_nothing(shot, pictures, tmp_path):
    words = ["--frames", "1", *places(shot, "--click"), "--dry-run", "--out", tmp_path / "cal"]
    rhot("colors", "cam", "--video", pictures, *words)
    assert not (tmp_path / "cal").exists()


def test_two_boxes_of_one_paint_are_warned_of(shot, pictures, tmp_path):
    x, y = shot[1]["green"]
    clicks = [
        word for color in ("green", "blue") for word in ("--click", f"{color}={x:.0f},{y:.0f}")
    ]
    result = rhot("colors", "cam", "--video", pictures, "--frames", "1", *clicks, "--out", tmp_path)
    assert "warning: blue and green collide" in result.stderr


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        ([], CalibrationError, "nothing is pointed at"),
        (["--click", "green=5,5", "--frames", "1"], CalibrationError, "something grey"),
        (["--click", "green=500,5", "--frames", "1"], CalibrationError, "outside the picture"),
        (["--box", "green=5,5,20,20", "--frames", "1"], CalibrationError, "no colour of its own"),
        (["--click", "green=5,5"], CalibrationError, "say which frames"),
        (["--at", "9:green=5,5"], CaptureError, "has 5 frames, numbered from 0; there is no 9"),
    ],
)
def test_what_is_wrong_is_said(pictures, tmp_path, words, error, message):
    with pytest.raises(error, match=message):
        rhot("colors", "cam", "--video", pictures, *words, "--out", tmp_path)
    assert not (tmp_path / "cam.colors.json").exists()


def test_it_asks_where_the_result_goes(pictures):
    with pytest.raises(CalibrationError, match="say where the result goes"):
        rhot("colors", "cam", "--video", pictures, "--frames", "1", "--click", "green=1,1")


def test_places_in_frames_need_a_recording():
    with pytest.raises(CalibrationError, match="give it with --video"):
        rhot("colors", "left", "--at", "1:green=1,1")


def test_missing_colours_of_the_rig_are_not_made_up(pictures, tmp_path):
    (tmp_path / "rig.toml").write_text(RIG.replace('"blue"', '"violet"'))
    with pytest.raises(CalibrationError, match="no patch was found that could be violet"):
        rhot("colors", "left", "--video", pictures, "--auto", "--config", tmp_path / "rig.toml")


def test_what_auto_misses_can_be_pointed_at_beside_it(shot, pictures, tmp_path):
    """Test: the missing colour is pointed at in one frame, as the error says."""
    (tmp_path / "rig.toml").write_text(RIG.replace('"blue"', '"violet"'))
    x, y = shot[1]["blue"]
    words = ["--auto", "--at", f"1:violet={x:.0f},{y:.0f}", "--config", tmp_path / "rig.toml"]
    rhot("colors", "left", "--video", pictures, *words)
    made = load_colors(tmp_path / "calibration", "left")
    assert set(made.colors) == {"green", "violet"}
    # What moves is told from all pictures, not from the one that was pointed at.
    assert sorted(made.inputs["frames"]) == [0, 1, 2, 3, 4]
    pointed_at = made.residuals["colors"]
    assert (pointed_at["violet"]["pictures"], pointed_at["green"]["pictures"]) == (1, 5)


@pytest.fixture
def tracker(router, shot, tmp_path):
    """A tracker on a router, in a thread of its own, with a camera that shows the two tips.

    Yields rig.toml.
    """
    path = tmp_path / "rig.toml"
    path.write_text(f'{RIG}[bus]\nconnect = ["{router}"]\nlisten = ["{router}"]\n')
    stop, ready = threading.Event(), threading.Event()
    frame = frame_of(noisy(shot[0], 5.0, 1), 0, "i420")

    async def film(bus):
        publisher = bus.publisher(topics.SIM_FRAME, camera="left")
        seq = 0
        while not stop.is_set():
            told = SimFrame(
                camera="left",
                seq=seq,
                stamp_ns=10**18 + seq,
                row_time_ns=1e4,
                size_px=SIZE,
                clock_skew_ns=0,
            )
            # No two pictures of a camera are the same.
            frame.image[-1, -1] = seq % 256
            publisher.put_bytes(frame.image.tobytes(), told)
            if await bus.get(topics.FRAME, 0.2, camera="left"):
                ready.set()
            await asyncio.sleep(0.02)
            seq += 1

    async def live():
        config = load_rig(path)
        with contextlib.suppress(asyncio.CancelledError):
            async with (
                open_bus("desk", [router]) as bus,
                open_bus("desk", [router]) as ours,
                asyncio.TaskGroup() as tasks,
            ):
                ours.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
                service = Service("pi_tracker", "left", config, bus, tasks)
                parts = [tasks.create_task(serve(service)), tasks.create_task(service.beat())]
                await film(ours)
                for part in parts:
                    part.cancel()

    thread = threading.Thread(target=lambda: uvloop.run(live()))
    thread.start()
    assert ready.wait(20.0)
    yield path
    stop.set()
    thread.join(10.0)


def click(config, color, x, y):
    """Calibrate one colour from one picture of the running camera."""
    words = ["--pictures", "1", "--click", f"{color}={x:.0f},{y:.0f}"]
    rhot("colors", "left", "--config", config, *words)


def test_a_running_camera_is_calibrated_over_the_bus(tracker, shot):
    result = rhot("colors", "left", "--config", tracker, "--pictures", "2", *places(shot, "--box"))
    assert "applied" in result.stderr
    made = load_colors(tracker.parent / "calibration", "left")
    assert set(made.colors) == {"green", "blue"}
    # One colour again: the other stays, in use and in the file.
    click(tracker, "green", *shot[1]["green"])
    assert load_colors(tracker.parent / "calibration", "left").colors["blue"] == made.colors["blue"]
    assert load_colors(tracker.parent / "calibration", "left").date >= made.date


def test_colours_may_come_one_after_the_other(tracker, shot):
    for color, (x, y) in shot[1].items():
        click(tracker, color, x, y)
    assert set(load_colors(tracker.parent / "calibration", "left").colors) == {"green", "blue"}


def test_exposure_of_a_camera_without_controls(tracker):
    result = rhot("camera", "left", "--config", tracker)
    assert "source 'simulator' has no exposure to set" in result.stdout
    assert "median brightness" in result.stdout
    with pytest.raises(RefusedError, match="has no exposure to set"):
        rhot("camera", "left", "--config", tracker, "--gain", "2")


def test_nobody_there_is_said_in_three_seconds(endpoint, tmp_path):
    (tmp_path / "rig.toml").write_text(RIG)
    with pytest.raises(BusError, match="no router answers"):
        rhot("colors", "left", "--config", tmp_path / "rig.toml", "--connect", endpoint, "--auto")
