"""`rhot grasp rectify`: pictures and videos of a plane, distances in it, and what goes wrong."""

from __future__ import annotations

import json
import re

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot.errors import RhotError
from rhot.files.calibration import save
from services.cli.application import application
from studies.grasp.scene.experiment import Experiment, Options
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.truth import lens_of, scene_file
from studies.grasp.scene.view import ViewOptions


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A picture, a video of two, its scene, and the folder."""
    folder = tmp_path_factory.mktemp("filmed")
    options = Options(view=ViewOptions((320, 240), tilt_deg=15.0), cycles=Cycles(1, 0.4, 10.0))
    shown = Experiment(SUBJECTS[0], options, 2)
    picture = shown.picture(0)
    cv2.imwrite(str(folder / "hand.png"), picture)
    code = cv2.VideoWriter_fourcc(*"FFV1")
    video = cv2.VideoWriter(str(folder / "hand.mkv"), cv2.CAP_FFMPEG, code, 10.0, (320, 240))
    for _ in range(2):
        video.write(picture)
    video.release()
    scene = scene_file(shown)
    save(folder / "side.lens.json", lens_of(shown))
    (folder / "edges.json").write_text(json.dumps(scene.straight_lines))
    return folder, shown, scene


def run(*words):
    return CliRunner().invoke(application(), ["grasp", "rectify", *map(str, words)])


def points(pixels):
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in pixels)


def millimetres(output):
    return [float(found) for found in re.findall(r": ([\d.]+) mm", output)]


@pytest.mark.parametrize("lens", ["--lens", "--straight"])
def test_a_picture_and_distances_from_a_rectangle(filmed, tmp_path, lens):
    folder, shown, scene = filmed
    file = "side.lens.json" if lens == "--lens" else "edges.json"
    joints = shown.pixels_of(0)
    result = run(
        *(folder / "hand.png", "--points", points(scene.reference.corners_px), "--size", "80x36"),
        *(lens, folder / file, "--out", tmp_path),
        *("--distance", points([joints["mcp"], joints["pip"]])),
        *("--distance", points([joints["base"], joints["mcp"]])),
    )
    assert result.exit_code == 0, result.output
    assert np.allclose(millimetres(result.output), [shown.subject.lengths[0], 42.0], rtol=0.01)
    assert "found by its edges" in result.output
    plane = json.loads((tmp_path / "plane.json").read_bytes())
    picture = cv2.imread(str(tmp_path / "rectified.png"))
    assert list(picture.shape[1::-1]) == plane["size_px"]


def test_a_video_before_its_reference(filmed, tmp_path):
    """The plane 20 mm nearer to the camera shows everything smaller."""
    folder, _, scene = filmed
    known = ("--points", points(scene.reference.corners_px), "--size", "80x36")
    ends = points(scene.reference.corners_px[:2])
    result = run(
        *(folder / "hand.mkv", *known, "--lens", folder / "side.lens.json", "--out", tmp_path),
        *("--nearer", 20, "--distance", ends, "--scale", 1.0),
    )
    assert result.exit_code == 0, result.output
    assert 0.9 < millimetres(result.output)[0] / 80.0 < 0.96
    video = cv2.VideoCapture(str(tmp_path / "rectified.mp4"))
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 2
    video.release()


def test_edges_and_one_length(filmed, tmp_path):
    folder, _, scene = filmed
    a, b, c, d = scene.reference.corners_px
    edges = [("--edge-x", (a, b)), ("--edge-x", (d, c)), ("--edge-y", (a, d)), ("--edge-y", (b, c))]
    words = [word for name, ends in edges for word in (name, points(ends))]
    result = run(
        *(folder / "hand.png", *words, "--lens", folder / "side.lens.json", "--out", tmp_path),
        *("--between", points([a, b]), "--length", 80, "--distance", points([b, c])),
    )
    assert result.exit_code == 0, result.output
    assert millimetres(result.output)[0] == pytest.approx(36.0, rel=0.01)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ((), "no reference"),
        (("--points", "1,1 9,1 9,9 1,9"), "--points without --size"),
        (("--points", "1,1 9,1 9,9", "--size", "80x36"), "4 are needed"),
        (("--points", "10,10 90,10 90,50 10,50", "--size", "0.08x0.036"), "looks like metres"),
        (("--between", "1,1 99,1", "--length", "0"), "no length"),
        (("--between", "1,1 99,1", "--length", "50", "--nearer", "9"), "needs the lens's focal"),
        (("--between", "1,1 99,1", "--length", "50", "--edge-x", "1,1 9,9"), "direction x has 1"),
        (("--between", "1,1 99,1", "--length", "50", "--scale", "900"), "choose a scale below"),
    ],
)
def test_what_says_no_plane_is_told(filmed, tmp_path, words, text):
    result = run(filmed[0] / "hand.png", "--out", tmp_path, *words)
    assert isinstance(result.exception, RhotError)
    assert text in str(result.exception)


def test_files_that_do_not_fit_are_told(filmed, tmp_path):
    folder, _, _ = filmed
    known = ("--between", "1,1 99,1", "--length", "50", "--out", tmp_path)
    (tmp_path / "bad.json").write_text("{}")
    cv2.imwrite(str(tmp_path / "other.png"), np.zeros((48, 64, 3), np.uint8))
    for words, text in (
        ((tmp_path / "none.png", *known), "no such picture"),
        ((tmp_path / "bad.json", *known), "no picture that can be decoded"),
        ((folder / "hand.png", "--straight", tmp_path / "bad.json", *known), "holds no edges"),
        ((tmp_path / "other.png", "--lens", folder / "side.lens.json", *known), "at 320x240"),
    ):
        result = run(*words)
        assert isinstance(result.exception, RhotError), result.output
        assert text in str(result.exception)
