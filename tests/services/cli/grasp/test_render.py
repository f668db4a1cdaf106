"""`rhot grasp render`: a video, its truth, and what goes wrong."""

from __future__ import annotations

import json

import cv2
import pytest
from typer.testing import CliRunner

from rhot.errors import ConfigError
from rhot.files.calibration import Lens, load
from services.cli.application import application
from studies.grasp.recording import load_recording

SHORT = ("--cycles", "1", "--period", "0.4", "--fps", "10", "--size", "160x120")


def run(*words):
    return CliRunner().invoke(application(), ["grasp", "render", *map(str, words)])


@pytest.mark.parametrize(("kind", "name"), [("lossy", "subject-3.mp4"), ("frames", "subject-3")])
def test_a_video_and_everything_known_of_it(tmp_path, kind, name):
    out = tmp_path / "set"
    result = run("--out", out, "--subject", "3", "--video", kind, *SHORT)
    assert result.exit_code == 0, result.output
    truth = load_recording(out / "subject-3.truth.json")
    if kind == "lossy":
        video = cv2.VideoCapture(str(out / name))
        assert video.get(cv2.CAP_PROP_FRAME_COUNT) == len(truth.frames)
        assert video.read()[1].shape == (120, 160, 3)
        video.release()
    else:
        assert len(list((out / name).glob("*.png"))) == len(truth.frames)
    assert truth.method == "truth"
    seeds = json.loads((out / "subject-3.seeds.json").read_bytes())
    assert list(seeds) == ["base", "mcp", "pip", "dip", "tip"]
    assert load(out / "subject-3.lens.json", Lens, "").size_px == (160, 120)
    assert json.loads((out / "subject-3.scene.json").read_bytes())["reference"]["size_mm"] == [
        80,
        36,
    ]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--dots", "pink"), "black, blue, green"),
        (("--size", "big"), "640x480"),
        (("--size", "63x48"), "64 to 4096"),
        (("--subject", "me"), "subject-5"),
    ],
)
def test_a_wrong_option_is_told_the_right_ones(tmp_path, words, text):
    result = run("--out", tmp_path / "set", *words)
    assert isinstance(result.exception, ConfigError)
    assert text in str(result.exception)


def test_a_folder_with_something_in_it_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    result = run("--out", tmp_path)
    assert "not an empty folder" in str(result.exception)
