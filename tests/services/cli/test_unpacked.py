"""Recordings of a live rig are scored, plotted and exported as results of `rhot track` are."""

from __future__ import annotations

import msgspec
import pytest

from rhot.errors import CaptureError
from rhot.files.capture import Capture
from services.cli.evaluate.score import score
from services.cli.evaluate.score_result import score_result
from services.cli.plot.plot import plot
from services.cli.unpacked import unpacked
from services.recorder.writer import RecordingWriter


def test_a_recording_scores_as_the_result_does(capture, result, recording):
    expected = score_result(Capture(capture), result, stages=True)
    with unpacked(recording) as (scene, tracked):
        found = score_result(scene, tracked, stages=True)
    assert found.hands == expected.hands
    assert found.objects == expected.objects
    assert found.stages == expected.stages


def test_the_command_scores_a_recording_alone_or_against_another_capture(
    capture, recording, capsys
):
    score(recording, as_json=True)
    alone = msgspec.json.decode(capsys.readouterr().out)
    score(capture, recording, as_json=True)
    assert msgspec.json.decode(capsys.readouterr().out)["hands"] == alone["hands"]


def test_a_recording_is_plotted_beside_it_with_its_truth(recording, capsys):
    plot(recording)
    names = {path.name for path in recording.with_suffix("").iterdir()}
    assert {"angles_right.png", "points_right.png", "markers_left.png"} <= names
    assert str(recording.with_suffix("")) in capsys.readouterr().out


def test_errors_name_the_recording_not_what_was_unpacked(result, tmp_path):
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, "desk", "1", {"config.json": b"{}"}):
        pass
    with pytest.raises(CaptureError) as raised:
        plot(path)
    assert str(path) in str(raised.value)
    assert "/rhot-" not in str(raised.value)


@pytest.mark.parametrize(
    ("kept", "message"),
    [({}, "holds no config.json"), ({"config.json": b"{no"}, "config.json is damaged")],
)
def test_a_recording_without_its_rig_says_so(tmp_path, kept, message):
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, "desk", "1", kept):
        pass
    with pytest.raises(CaptureError, match=message), unpacked(path):
        pass


def test_names_of_calibration_files_lead_nowhere_else(tmp_path):
    path = tmp_path / "r.mcap"
    names = ("calibration/../../evil.json", "calibration/a/b.json", "calibration/..json")
    kept = {"config.json": b"{}", **dict.fromkeys(names, b"{}"), "calibration/left.json": b"{}"}
    with RecordingWriter(path, "desk", "1", kept):
        pass
    with unpacked(path) as (capture, _):
        written = {one.name for one in capture.folder.parent.rglob("*.json")}
    assert written <= {"left.json", "..json", "summary.json"}
