"""`rhot score` over the simulated capture, and over results that cannot be scored."""

from __future__ import annotations

import json
import shutil

import msgspec
import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError
from rhot.files.capture import Capture, read_lines, write_lines
from rhot.hand import DIGIT_ANGLES, DIGITS
from rhot.messages import HandPose
from services.cli.application import application
from services.cli.evaluate.score_result import score_result


@pytest.fixture
def copy(result, tmp_path):
    """The result, to break."""
    shutil.copytree(result, tmp_path / "result")
    return tmp_path / "result"


def test_the_pipeline_is_as_good_as_promised(capture, result):
    """Issue 2: finger tips within 5 mm RMS at 0.5 m, joint angles within 10 deg on average, no
    limit violated.
    """
    score = score_result(Capture(capture), result)
    hand = score.hands["right"]
    assert hand.distance_m == pytest.approx(0.5, abs=0.05)
    assert hand.tips_rms_mm <= 5.0
    assert hand.angles_mean_deg <= 10.0
    assert hand.violations.count == 0
    assert hand.coverage.missed_share < 0.1
    assert score.objects["cup"].position.total_rms_mm < 2.0
    assert score.notes == []


def test_stages_tell_where_the_error_comes_from(capture, result):
    stages = score_result(Capture(capture), result, stages=True).stages["right"]
    assert set(stages.markers) == {"left", "right"}
    landmarks = {"wrist", *(f"{digit}_tip" for digit in DIGITS)}
    for camera in stages.markers.values():
        assert set(camera) == landmarks
        assert all(max(error.rms_px) < 3.0 and error.strays <= 2 for error in camera.values())
    assert set(stages.points) == landmarks
    assert all(point.error.total_rms_mm < 8.0 for point in stages.points.values())


def test_the_command_prints_tables_or_json(capture, result):
    text = CliRunner().invoke(application(), ["score", str(capture), str(result), "--stages"])
    assert text.exit_code == 0
    for part in (
        "thumb_tip",
        "RMS mm",
        "index pip",
        "hand orientation",
        "dropouts",
        "limit violations",
        "delay",
        "cup",
        "left wrist",
    ):
        assert part in text.stdout
    assert "middle abduction" not in text.stdout  # fixed
    found = json.loads(
        CliRunner().invoke(application(), ["score", str(capture), str(result), "--json"]).stdout
    )
    assert tuple(found["hands"]["right"]["angles"]["thumb"]) == DIGIT_ANGLES[0]
    assert found["stages"] == {}


def test_poses_that_are_off_by_a_known_amount_score_so(capture, copy):
    poses = list(read_lines(copy / "poses.jsonl", HandPose))
    before = score_result(Capture(capture), copy).hands["right"]

    def moved(pose):
        joints = [
            msgspec.structs.replace(j, position_m=(j.position_m[0] + 0.01, *j.position_m[1:]))
            for j in pose.joints
        ]
        return msgspec.structs.replace(pose, joints=joints)

    write_lines(copy / "poses.jsonl", [moved(pose) for pose in poses])
    after = score_result(Capture(capture), copy).hands["right"]
    for tip, error in after.tips.items():
        assert error.bias_mm[0] - before.tips[tip].bias_mm[0] == pytest.approx(10.0, abs=0.01)
    assert after.wrist == before.wrist


def test_a_capture_without_truth_or_a_folder_that_is_none(capture, copy, tmp_path):
    with pytest.raises(CaptureError, match="no such folder"):
        score_result(Capture(tmp_path / "gone"), copy)
    shutil.copytree(capture, tmp_path / "real", ignore=shutil.ignore_patterns("truth.jsonl"))
    with pytest.raises(CaptureError, match=r"no truth\.jsonl; only captures of `rhot simulate`"):
        score_result(Capture(tmp_path / "real"), copy)


def test_a_result_of_another_capture_or_without_poses(capture, copy):
    poses = list(read_lines(copy / "poses.jsonl", HandPose))
    write_lines(
        copy / "poses.jsonl",
        [msgspec.structs.replace(pose, stamp_ns=pose.stamp_ns + 10**12) for pose in poses],
    )
    with pytest.raises(CaptureError, match="not of this capture"):
        score_result(Capture(capture), copy)
    write_lines(
        copy / "poses.jsonl", [msgspec.structs.replace(pose, hand="left") for pose in poses]
    )
    with pytest.raises(CaptureError, match="no pose of the right hand"):
        score_result(Capture(capture), copy)
    write_lines(copy / "poses.jsonl", [])
    with pytest.raises(CaptureError, match="no pose of the right hand"):
        score_result(Capture(capture), copy)


def test_an_interrupted_result(capture, copy):
    (copy / "poses.jsonl").rename(copy / "poses.jsonl.partial")
    with pytest.raises(CaptureError, match="interrupted"):
        score_result(Capture(capture), copy)
