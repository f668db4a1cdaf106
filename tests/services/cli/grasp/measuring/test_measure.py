"""`rhot grasp measure`: from a video to angles, and what goes wrong."""

from __future__ import annotations

import csv
import json

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot.errors import CalibrationError, CaptureError
from services.cli.application import application
from studies.grasp.recording import load_recording

JOINTS = ("mcp", "pip", "dip", "tip")


def run(*words):
    return CliRunner().invoke(application(), ["grasp", "measure", *map(str, words)])


def places(number):
    """Four dots in a row that bends."""
    turn, at = 0.1, np.array([40.0, 40.0])
    found = [at]
    for length in (50.0, 32.0, 24.0):
        at = at + length * np.array([np.cos(turn), np.sin(turn)])
        found.append(at)
        turn += 0.15 + 0.06 * number
    return np.array(found)


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    """Ten pictures of red dots on skin, at times that are not regular."""
    folder = tmp_path_factory.mktemp("video")
    for number in range(10):
        image = np.full((120, 180, 3), (150, 175, 200), np.uint8)
        for x, y in places(number):
            cv2.circle(image, (round(16 * x), round(16 * y)), 80, (40, 30, 200), -1, cv2.LINE_AA, 4)
        cv2.imwrite(str(folder / f"{number:03d}.png"), image)
    return folder


SEEDS = [
    word
    for joint, (x, y) in zip(JOINTS, places(0), strict=True)
    for word in ("--seed", f"index_{joint}={x:.0f},{y:.0f}")
]


def test_files_and_overlay(video, tmp_path):
    out = tmp_path / "out"
    result = run(
        video, "--out", out, *SEEDS, "--base", "0,36,40,40", "--length", "index_proximal_mm=45"
    )
    assert result.exit_code == 0, result.output
    recording = load_recording(out / "index.json")
    assert len(recording.frames) == 10
    assert recording.unit == "mm"
    assert recording.lengths == pytest.approx((45.0, 28.8, 21.6), rel=0.01)
    bend = [frame.angles_rad["pip"] for frame in recording.frames]
    assert bend == pytest.approx([0.15 + 0.06 * number for number in range(10)], abs=0.01)
    with open(out / "index.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[9]["pip_deg"]) == pytest.approx(np.degrees(bend[9]), abs=0.01)
    assert float(rows[0]["index_tip_x_px"]) == pytest.approx(places(0)[3][0], abs=0.3)
    assert "pip  in 10 of 10 pictures" in result.output
    assert "30 a second assumed" in result.output
    film = cv2.VideoCapture(str(out / "overlay.webm"))
    shapes = []
    while (read := film.read())[0]:
        shapes.append(read[1].shape)
    film.release()
    assert shapes == [(120, 180, 3)] * 10


def test_without_seeds_the_first_picture_is_left_with_a_grid(video, tmp_path):
    result = run(video, "--out", tmp_path / "out")
    assert isinstance(result.exception, CaptureError)
    assert "no seeds: say where each joint is" in str(result.exception)
    assert cv2.imread(str(tmp_path / "out" / "first-frame.png")).shape == (120, 180, 3)


def test_seeds_of_a_file(video, tmp_path):
    seeds = {joint: at.tolist() for joint, at in zip(JOINTS, places(0), strict=True)}
    (tmp_path / "seeds.json").write_text(json.dumps(seeds))
    result = run(
        video, "--out", tmp_path / "out", "--seeds", tmp_path / "seeds.json", "--no-overlay"
    )
    assert result.exit_code == 0, result.output
    assert "no base line" in result.output
    assert "no reference length" in result.output
    assert not (tmp_path / "out" / "overlay.webm").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--seed", "index_tip=1,2,3"), "is not joint=x,y"),
        ((*SEEDS, "--length", "index_proximal_mm=0.045"), "metres were given: write 45"),
        ((*SEEDS, "--base", "1,2"), "is not x1,y1,x2,y2"),
        ((*SEEDS, "--hsv", "red"), "--hsv red"),
        ((*SEEDS, "--color", "red"), "belong together"),
        ((*SEEDS[:6], "--seed", "index_tip=500,20"), "lies outside the picture, which is 180x120"),
    ],
)
def test_a_wrong_option_is_told_the_right_ones(video, tmp_path, words, text):
    result = run(video, "--out", tmp_path / "out", *words)
    assert isinstance(result.exception, CaptureError)
    assert text in str(result.exception)


def test_what_cannot_be_read(video, tmp_path):
    (tmp_path / "text.mp4").write_text("no video")
    for path, text in ((tmp_path / "none.mp4", "no such video"), (tmp_path / "text.mp4", "cannot")):
        result = run(path, "--out", tmp_path / "out", *SEEDS)
        assert isinstance(result.exception, CaptureError)
        assert text in str(result.exception)
    result = run(video, "--out", tmp_path / "out", *SEEDS, "--lens", tmp_path / "none.lens.json")
    assert isinstance(result.exception, CalibrationError)
