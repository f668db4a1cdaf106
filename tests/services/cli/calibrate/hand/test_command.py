"""`rhot calibrate hand` from the command line; the fit has tests of its own."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from rhot import topics
from rhot.errors import CalibrationError, CaptureError
from rhot.files.config import RigConfig
from rhot.hand_exercises import EXERCISES
from rhot.messages import HandPoints
from services.cli.calibrate.calibrate import calibrate
from services.cli.calibrate.hand.command import lengths_of
from services.cli.calibrate.hand.recorded import recorded
from services.recorder.recorder import Recorder


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
