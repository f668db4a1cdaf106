"""`rhot simulate --motion`: a real hand rendered and tracked, or its points without pictures."""

from __future__ import annotations

import json
from collections.abc import Iterable

import msgspec
import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from typer.testing import CliRunner

from rhot.errors import CaptureError, ConfigError
from rhot.files.capture import Capture, read_lines
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.simulator import Truth
from services.cli.application import application
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run


def rhot(*arguments):
    return CliRunner().invoke(application(), [*map(str, arguments)])


def _errors_mm(
    found: Iterable[tuple[int, dict[str, tuple]]], truth: dict[int, dict[str, tuple]]
) -> np.ndarray:
    """Of each landmark that every line of the truth has; between its lines a cubic is the truth."""
    names = [name for name in BASIC_LANDMARKS if all(name in line for line in truth.values())]
    start_ns = min(truth)
    times_s = [(stamp_ns - start_ns) * 1e-9 for stamp_ns in truth]
    places = CubicSpline(times_s, [[line[name] for name in names] for line in truth.values()])
    errors = [
        np.subtract(positions[name], places((stamp_ns - start_ns) * 1e-9)[names.index(name)])
        for stamp_ns, positions in found
        for name in names
        if name in positions
    ]
    return 1e3 * np.linalg.norm(errors, axis=1)


def test_a_real_hand_is_rendered_and_tracked(rhot_data, tmp_path):
    file = rhot_data / "hand_motion/leap/pinch.csv"
    capture = Capture(tmp_path / "c")
    made = rhot("simulate", "--motion", file, "--seconds", 1, "--out", capture.folder, "--json")
    told = json.loads(made.stdout)
    assert told["mode"] == "hand"
    assert told["hand"] == "right"
    assert not told["to_and_fro"]
    assert told["worst_tip_mm"] < 0.02
    assert told["in_view"] == 1.0
    run(job_of([str(capture.folder)], None), tmp_path / "r")
    truth = {
        line.stamp_ns: {name: line.hands["right"].points_m[name] for name in BASIC_LANDMARKS}
        for line in read_lines(capture.truth, Truth)
    }
    # Points are of paint, poses of the joints that the truth has.
    joints = (
        (pose.stamp_ns, {joint.name: joint.position_m for joint in pose.joints})
        for pose in read_lines(tmp_path / "r" / "poses.jsonl", HandPose)
    )
    errors = _errors_mm(joints, truth)
    assert len(errors) > 100
    assert np.median(errors) < 3.0
    # The hand that was rendered is saved as one that somebody measured.
    model = json.loads((capture.folder / "calibration/hand.right.json").read_text())
    assert model["origin"] == "recorded"


def test_a_glove_gives_markers_that_are_tracked_without_pictures(rhot_data, tmp_path):
    file = rhot_data / "hand_motion/qualisys/recording.tsv.gz"
    folder = tmp_path / "c"
    made = rhot("simulate", "--motion", file, "--seconds", 3, "--distance", 0.7, "--out", folder)
    assert made.exit_code == 0
    assert "no bones fit them" in made.stdout
    assert not list(folder.glob("*.mkv"))
    summary = run(job_of([str(folder)], None), tmp_path / "r")
    assert summary.complete
    assert summary.cameras["left"].frames == sum(
        frame.camera == "left" for frame in read_lines(Capture(folder).markers, MarkerFrame)
    )
    truth = {
        line.stamp_ns: {point.name: point.position_m for point in line.points}
        for line in read_lines(folder / "truth_points.jsonl", HandPoints)
    }
    points = (
        (message.stamp_ns, {point.name: point.position_m for point in message.points})
        for message in read_lines(tmp_path / "r" / "points.jsonl", HandPoints)
    )
    errors = _errors_mm(points, truth)
    assert len(errors) > 200
    assert np.median(errors) < 2.0
    assert summary.poses > 50


def test_a_short_recording_goes_to_and_fro(rhot_data, tmp_path):
    file = rhot_data / "hand_motion/leap/wave.csv"
    folder = tmp_path / "c"
    made = rhot("simulate", "--motion", file, "--seconds", 1.2, "--fps", 5, "--out", folder)
    assert "to and fro, as the recording lasts 0.954 s" in made.stdout


def test_markers_of_a_camera_that_nobody_knows_are_an_error(rhot_data, tmp_path):
    file = rhot_data / "hand_motion/qualisys/recording.tsv.gz"
    folder = tmp_path / "c"
    rhot("simulate", "--motion", file, "--seconds", 0.3, "--out", folder)
    markers = Capture(folder).markers
    first = next(read_lines(markers, MarkerFrame))
    alien = msgspec.structs.replace(first, camera="attic")
    markers.write_bytes(msgspec.json.encode(alien) + b"\n" + markers.read_bytes())
    with pytest.raises(CaptureError, match=r"line 1: camera 'attic' is not in rig.toml"):
        run(job_of([str(folder)], None), tmp_path / "r")


def test_what_is_asked_for_must_be_one_thing(tmp_path):
    both = rhot("simulate", "fist", "--motion", "x.csv", "--out", tmp_path / "c").exception
    assert isinstance(both, ConfigError)
    assert "or --motion FILE instead" in str(both)
    missing = rhot("simulate", "--motion", tmp_path / "x.csv", "--out", tmp_path / "c").exception
    assert isinstance(missing, CaptureError)
    assert "cannot be read" in str(missing)
    assert not (tmp_path / "c").exists()
