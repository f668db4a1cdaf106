"""`rhot grasp measure --reference`: a finger that is filmed at a slant, in mm of its own plane."""

from __future__ import annotations

import json

import cv2
import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from rhot.errors import RhotError
from rhot.files.calibration import save
from services.cli.application import application
from studies.grasp.recording import load_recording
from studies.grasp.scene.experiment import Experiment, Options
from studies.grasp.scene.motion import Cycles
from studies.grasp.scene.subjects import SUBJECTS
from studies.grasp.scene.truth import lens_of, scene_file, seeds_of, truth_of
from studies.grasp.scene.view import ViewOptions


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Eight pictures of a closing fist, the camera tilted by 25 degrees."""
    folder = tmp_path_factory.mktemp("slanted")
    cycles = Cycles(1, 1.0, 16.0, sway=0.3)
    shown = Experiment(SUBJECTS[0], Options(view=ViewOptions(tilt_deg=25.0), cycles=cycles), 4)
    (folder / "pictures").mkdir()
    for frame in range(8):
        cv2.imwrite(str(folder / "pictures" / f"{frame:03d}.png"), shown.picture(frame))
    (folder / "seeds.json").write_text(json.dumps(seeds_of(shown)))
    save(folder / "lens.json", lens_of(shown))
    return folder, shown


def run(folder, out, *words):
    command = [folder / "pictures", "--seeds", folder / "seeds.json", "--out", out, "--no-overlay"]
    return CliRunner().invoke(
        application(), ["grasp", "measure", *map(str, [*command, *words, "--fps", "16"])]
    )


def rectangle(shown, size="80x36", off=0.0):
    corners = scene_file(shown).reference.corners_px
    return f"rectangle={size}:" + ":".join(f"{x + off:.0f},{y:.0f}" for x, y in corners)


def off_deg(recording, truth):
    """Angles' errors, RMS of each joint, and what was told."""
    found = [
        [
            (frame.angles_rad[joint] - true.angles_rad[joint], frame.angles_sigma_rad[joint])
            for frame, true in zip(recording.frames, truth.frames, strict=False)
            if joint in frame.angles_rad
        ]
        for joint in ("mcp", "pip", "dip")
    ]
    rms = [np.degrees(np.sqrt(np.mean(np.square(np.array(one)[:, 0])))) for one in found]
    return np.array(rms), [np.degrees(np.median(np.array(one)[:, 1])) for one in found]


def test_angles_and_bones_are_those_of_the_plane(filmed, tmp_path):
    folder, shown = filmed
    truth = truth_of(shown)[0]
    lens = ("--lens", folder / "lens.json")
    result = run(folder, tmp_path / "a", *lens, "--reference", rectangle(shown, off=1.0))
    assert result.exit_code == 0, result.output
    recording = load_recording(tmp_path / "a" / "index.json")
    assert "reference: found by its edges" in " ".join(recording.notes)
    rms, told = off_deg(recording, truth)
    assert rms.max() < 1.0
    assert (np.array(told) > 0.1).all()
    assert recording.unit == "mm"
    assert np.allclose(recording.lengths, truth.lengths, rtol=0.02)
    # What a scale alone makes of the same pictures.
    assert run(folder, tmp_path / "b", *lens).exit_code == 0
    plain, _ = off_deg(load_recording(tmp_path / "b" / "index.json"), truth)
    assert plain.max() > 2.0 * rms.max()


def test_straight_edges_stand_for_a_calibrated_lens(filmed, tmp_path):
    folder, shown = filmed
    (tmp_path / "edges.json").write_bytes(msgspec.json.encode(scene_file(shown).straight_lines))
    straight = ("--straight", tmp_path / "edges.json", "--reference", rectangle(shown))
    result = run(folder, tmp_path / "a", *straight)
    assert result.exit_code == 0, result.output
    recording = load_recording(tmp_path / "a" / "index.json")
    assert any("edges were bent by" in note for note in recording.notes)
    truth = truth_of(shown)[0]
    assert np.allclose(recording.lengths, truth.lengths, rtol=0.015)
    rms, _ = off_deg(recording, truth)
    assert rms.max() < 1.0
    both = run(folder, tmp_path / "b", *straight, "--lens", folder / "lens.json")
    assert "give one" in str(both.exception)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--reference", "card"), "begins with rectangle="),
        (("--length", "index_proximal_mm=40"), "give one"),
    ],
)
def test_a_reference_that_will_not_do_is_told(filmed, tmp_path, words, text):
    folder, shown = filmed
    given = words if words[0] == "--reference" else (*words, "--reference", rectangle(shown))
    result = run(folder, tmp_path, *given)
    assert isinstance(result.exception, RhotError)
    assert text in str(result.exception)


def test_a_reference_of_the_wrong_size_is_told_by_the_bones(filmed, tmp_path):
    folder, shown = filmed
    result = run(folder, tmp_path, "--reference", rectangle(shown, "800x360"))
    assert isinstance(result.exception, RhotError)
    assert "--reference: a" in str(result.exception)
    assert "phalanx" in str(result.exception)
