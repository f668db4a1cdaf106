"""`rhot calibrate hand` from the command line; the fit has tests of its own."""

from __future__ import annotations

import asyncio
import io
import itertools
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import load_hand
from rhot.files.capture import write_lines
from rhot.files.config import RigConfig
from rhot.hand import default_hand
from rhot.hand_exercises import EXERCISES
from rhot.messages import HandPoints
from services.calibrator.guided.hand_fitting import Wanted
from services.cli.calibrate.calibrate import calibrate
from services.cli.calibrate.hand.command import lengths_of
from services.cli.calibrate.hand.recorded import recorded
from services.cli.calibrate.hand.watch import watched_hand
from services.cli.terminal import Terminal
from services.recorder.recorder import Recorder
from services.simulator.hands.gestures import MOTIONS
from testing.synthetic_hands import hand_message, noisy_points, wrist_rotation


def test_the_exercises_are_listed() -> None:
    result = CliRunner().invoke(calibrate, ["hand", "--list"])
    assert result.exit_code == 0
    assert result.output.count("\n") == len(EXERCISES)
    assert "spread the fingers" in result.output


def test_lengths_measured_by_hand() -> None:
    assert lengths_of(["index:proximal=39.5", "thumb:metacarpal=46"]) == {
        (1, 0): pytest.approx(0.0395),
        (0, 0): pytest.approx(0.046),
    }
    for wrong in (
        "index:proximal",
        "toe:distal=3",
        "index:metacarpal=60",
        "index:distal=nan",
        "index:distal=500",
    ):
        with pytest.raises(CalibrationError, match="DIGIT:BONE=MM"):
            lengths_of([wrong])


def test_what_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="is no capture"):
        recorded(tmp_path, "right", None)
    (tmp_path / "points.jsonl").write_text("")
    assert recorded(tmp_path, "right", None) == []
    result = CliRunner().invoke(
        calibrate, ["hand", "right", "--from", str(tmp_path), "--out", str(tmp_path)]
    )
    assert isinstance(result.exception, CalibrationError)
    assert "no points of a right hand" in str(result.exception)
    assert not list(tmp_path.glob("hand.*"))


def test_a_recording_of_the_rig(tmp_path: Path) -> None:
    points = HandPoints(hand="right", seq=1, stamp_ns=10**18, points=[])
    recorder = Recorder(RigConfig(), tmp_path)
    path = recorder.start(10**18)
    for hand in ("right", "left"):
        message = msgspec.structs.replace(points, hand=hand)
        recorder.add(
            topics.POINTS, topics.POINTS.key("sim", hand=hand), msgspec.json.encode(message), 10**18
        )
    recorder.stop()
    assert recorded(path, "right", None) == [points]


@pytest.fixture(scope="module")
def used() -> list[HandPoints]:
    """Half a minute of random motion of a small hand, with 1 mm of noise."""
    model = default_hand("right", 0.85)
    random, motion = np.random.default_rng(3), MOTIONS["random"](model, 8)
    messages = []
    for frame in range(900):
        gesture = motion(frame / 30.0)
        R = wrist_rotation(gesture, np.zeros(3))
        position_m = np.array([0.0, 0.0, 0.5]) + gesture.shift_m
        points = noisy_points(model, R, position_m, gesture.angles_rad, random)
        messages.append(hand_message(model, frame, frame / 30.0, points))
    return messages


def test_any_motion_measures_the_hand(tmp_path: Path, used: list[HandPoints]) -> None:
    write_lines(tmp_path / "points.jsonl", used)
    arguments = ["hand", "right", "--from", str(tmp_path), "--out", str(tmp_path)]
    result = CliRunner().invoke(calibrate, arguments, catch_exceptions=False)
    assert "cannot be told apart" in result.output or "the recording lasts 30 s" in result.output
    assert "measured from free motion" in result.output
    assert "after 30 s of motion: size 0.8" in result.output
    assert load_hand(tmp_path, "right").origin == "measured"
    # Refused: both reasons.
    write_lines(tmp_path / "points.jsonl", used[:300])
    result = CliRunner().invoke(calibrate, arguments)
    assert isinstance(result.exception, CalibrationError)
    assert "as exercises: the exercises take 48 s, the recording lasts 10 s" in str(
        result.exception
    )
    assert "as free motion: wrist and all tips were seen together for 10 s" in str(result.exception)


async def test_a_hand_measures_itself_while_the_rig_is_used(
    router: str, used: list[HandPoints]
) -> None:
    said = io.StringIO()
    wanted = Wanted("right", "live", "2026-01-01")
    async with asyncio.timeout(120.0), open_bus("desk", [router]) as bus:
        points = bus.publisher(topics.POINTS, hand="right")

        async def use() -> None:
            # Over and over: a busy machine drops some.
            for number, message in enumerate(itertools.cycle(used)):
                stamp_ns = message.stamp_ns + number // len(used) * 30_000_000_000
                points.put(msgspec.structs.replace(message, seq=number, stamp_ns=stamp_ns))
                await asyncio.sleep(0.006)

        using = asyncio.create_task(use())
        made = await watched_hand("desk", [router], wanted, 25.0, Terminal(out=said), every_s=2.0)
        using.cancel()
    assert made.seconds >= 25.0
    assert made.size == pytest.approx(0.85, abs=0.04)
    # What is known is told from the beginning.
    assert "not yet: wrist and all tips were seen together" in said.getvalue()
    assert "s of motion: size 0.8" in said.getvalue()


def test_only_a_hand_of_the_rig_is_watched(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text('[[camera]]\nname = "left"\n')
    arguments = ["hand", "left", "--watch", "--config", str(tmp_path / "rig.toml")]
    result = CliRunner().invoke(calibrate, arguments)
    assert isinstance(result.exception, CalibrationError)
    assert "no [hand.left.markers]" in str(result.exception)
