"""`rhot track` over a short simulated capture and a real video: results, determinism, bad input."""

from __future__ import annotations

import json
import shutil

import pytest
from typer.testing import CliRunner

from rhot.errors import CalibrationError, CaptureError, ConfigError
from rhot.files.capture import read_lines
from rhot.files.config import load_rig
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectContacts, ObjectPose
from services.cli.application import application
from services.cli.offline.inputs import job_of
from services.cli.offline.results import STREAMS
from services.cli.offline.run import run
from services.cli.recorded.unpacked_capture import readable
from services.recorder.recorder import attachments
from services.recorder.writer import RecordingWriter

FILES = (*(f"{name}.jsonl" for name in STREAMS), "summary.json")


def track(sources, out, config=None):
    return run(job_of([str(source) for source in sources], config), out)


def test_a_capture_becomes_markers_points_poses_and_objects_in_wire_format(capture, result):
    frames = list(read_lines(result / "markers.jsonl", MarkerFrame))
    points = list(read_lines(result / "points.jsonl", HandPoints))
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    objects = list(read_lines(result / "objects.jsonl", ObjectPose))
    contacts = len(list(read_lines(result / "contacts.jsonl", ObjectContacts)))
    summary = json.loads((result / "summary.json").read_text())
    assert summary["complete"]
    assert summary["warnings"] == []
    assert [summary[name] for name in STREAMS] == [
        len(frames),
        len(points),
        len(poses),
        len(objects),
        contacts,
    ]
    # Objects without a shape are touched by nobody.
    assert (contacts > 0) == any(item.shape for item in load_rig(capture / "rig.toml").object)
    assert len(frames) == sum(one.total for one in job_of([str(capture)], None).inputs)
    assert 50 < len(poses) <= 62
    # Two seconds of 120 poses each.
    assert len(objects) == 240
    assert all(one.sent_ns == 0 for one in (*frames, *points, *poses, *objects))
    assert [(f.stamp_ns, f.camera) for f in frames] == sorted(
        (f.stamp_ns, f.camera) for f in frames
    )


def test_the_same_capture_gives_the_same_bytes(capture, result, tmp_path):
    track([capture], tmp_path / "again")
    for name in FILES:
        assert (tmp_path / "again" / name).read_bytes() == (result / name).read_bytes(), name


def test_videos_with_their_stamps_give_what_the_capture_gives(capture, result, tmp_path):
    """Colour videos are read as they are, so that only the pictures' way in differs."""
    track(
        [f"left={capture / 'left.mkv'}", f"right={capture / 'right.mkv'}"],
        tmp_path / "videos",
        capture / "rig.toml",
    )
    for name in ("markers.jsonl", "poses.jsonl"):
        assert (tmp_path / "videos" / name).read_bytes() == (result / name).read_bytes()


def test_one_camera_of_two_gives_markers_and_says_why_nothing_more(short_capture, tmp_path):
    summary = track(
        [f"left={short_capture / 'left.mkv'}"], tmp_path / "out", short_capture / "rig.toml"
    )
    assert summary.markers > 10
    assert (summary.points, summary.poses) == (0, 0)
    assert "needs two cameras" in summary.notes[0]


def test_without_a_hand_all_calibrated_colours_are_tracked(copy, tmp_path):
    text = (copy / "rig.toml").read_text()
    (copy / "rig.toml").write_text(text[: text.index("[hand]")] + text[text.index("[fusion]") :])
    summary = track([copy], tmp_path / "out")
    assert set(summary.cameras["left"].colors) == {
        "violet",
        "magenta",
        "blue",
        "cyan",
        "green",
        "lime",
        "leaf",
    }
    assert "no [hand.right.markers]" in summary.notes[0]


def test_a_truncated_video_is_tracked_up_to_there_with_a_warning(copy, tmp_path):
    data = (copy / "right.mkv").read_bytes()
    (copy / "right.mkv").write_bytes(data[: len(data) // 2])
    summary = track([copy], tmp_path / "out")
    assert not summary.complete
    assert "right.mkv" in summary.warnings[0]
    assert 3 < summary.cameras["right"].frames < summary.cameras["left"].frames
    assert summary.poses > 3


def test_a_video_without_a_single_frame_fails_and_leaves_nothing(copy, tmp_path):
    (copy / "right.mkv").write_bytes(b"no video")
    with pytest.raises(CaptureError, match=r"right\.mkv"):
        track([copy], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_camera_without_its_video(copy, tmp_path):
    (copy / "right.mkv").unlink()
    with pytest.raises(CaptureError, match=r"no video of camera 'right'; it has left"):
        track([copy], tmp_path / "out")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("rig.json", "rhot calibrate stereo"),
        ("left.lens.json", "rhot calibrate lens left"),
        ("left.colors.json", "rhot calibrate colors left"),
    ],
)
def test_a_missing_calibration_names_the_command_that_makes_it(copy, tmp_path, name, text):
    (copy / "calibration" / name).unlink()
    with pytest.raises(CalibrationError, match=text):
        track([copy], tmp_path / "out")


def test_pictures_of_another_size_than_the_lens(copy, tmp_path):
    path = copy / "calibration" / "left.lens.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"size_px": [1280, 960]}))
    with pytest.raises(CalibrationError, match="640 x 480, its lens was calibrated at 1280 x 960"):
        track([copy], tmp_path / "out")


def test_a_marker_colour_that_is_not_calibrated(copy, tmp_path):
    path = copy / "calibration" / "left.colors.json"
    colors = json.loads(path.read_text())
    del colors["colors"]["blue"]
    path.write_text(json.dumps(colors))
    with pytest.raises(CalibrationError, match="'blue'"):
        track([copy], tmp_path / "out")


def test_objects_without_registration_stay_in_the_lighthouse_frame_with_a_note(copy, tmp_path):
    (copy / "calibration" / "objects.json").unlink()
    summary = track([copy], tmp_path / "out")
    assert any("lighthouse frame" in note for note in summary.notes)
    assert not any(
        pose.registered for pose in read_lines(tmp_path / "out" / "objects.jsonl", ObjectPose)
    )


def test_a_broken_line_of_objects_is_an_error_with_its_number(copy, tmp_path):
    lines = (copy / "objects.jsonl").read_bytes().splitlines()
    lines[6] = b'{"v": "one"}'
    (copy / "objects.jsonl").write_bytes(b"\n".join(lines))
    with pytest.raises(CaptureError, match=r"objects\.jsonl: line 7"):
        track([copy], tmp_path / "out")


def test_a_broken_rig_toml(copy, tmp_path):
    (copy / "rig.toml").write_text('[fusion]\nmethod = "magic"\n')
    with pytest.raises(ConfigError, match="'magic'; valid"):
        track([copy], tmp_path / "out")


def test_a_real_ball_is_found_where_it_is_and_nowhere_else(rhot_data, tmp_path):
    """1004 frames of a webcam.

    Frame numbers read off the video by eye: the ball is out of sight four times.
    """
    (tmp_path / "calibration").mkdir()
    (tmp_path / "rig.toml").write_text('[rig]\nname = "ball"\n')
    # The range the recording's README gives.
    colors = '{"colors": {"green": {"hsv_low": [35, 60, 40], "hsv_high": [85, 255, 255]}}}'
    (tmp_path / "calibration" / "cam.colors.json").write_text(colors)
    summary = track(
        [f"cam={rhot_data / 'color_video' / 'ball2.mp4'}"], tmp_path / "out", tmp_path / "rig.toml"
    )
    assert summary.cameras["cam"].frames == 1004
    assert summary.cameras["cam"].frames_with_markers >= 865
    seen = {
        frame.seq
        for frame in read_lines(tmp_path / "out" / "markers.jsonl", MarkerFrame)
        if frame.markers
    }
    for first, last in ((0, 26), (466, 486), (790, 822), (964, 1003)):
        assert not seen & set(range(first, last + 1))


def test_the_command_prints_a_summary_and_notes_and_nothing_else_on_a_pipe(short_capture, tmp_path):
    sources = [f"left={short_capture / 'left.mkv'}", "--config", str(short_capture / "rig.toml")]
    text = CliRunner().invoke(application(), ["track", *sources, "--out", str(tmp_path / "a")])
    assert text.exit_code == 0
    assert "note: markers only" in text.stderr
    assert "\r" not in text.stderr
    assert text.stdout.startswith("left: ")
    found = CliRunner().invoke(
        application(), ["track", *sources, "--out", str(tmp_path / "b"), "--json"]
    )
    assert json.loads(found.stdout)["cameras"]["left"]["frames"] > 10


def test_a_recording_is_tracked_anew_from_its_markers(capture, result, recording, tmp_path):
    """Its markers are the result's, and so are the points and poses that come of them."""
    ran = CliRunner().invoke(
        application(), ["track", str(recording), "--out", str(tmp_path / "again")]
    )
    assert ran.exit_code == 0, ran.stderr
    for name in ("markers", "points", "poses"):
        again = (tmp_path / "again" / f"{name}.jsonl").read_bytes()
        assert again == (result / f"{name}.jsonl").read_bytes(), name
    summary = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert summary["origin"]["sources"] == [str(recording)]


def test_a_recording_without_markers_or_with_a_broken_rig_is_named(tmp_path, capture):
    kept = attachments(load_rig(capture / "rig.toml"))
    for name, own, message in (
        ("empty", kept, "empty.mcap: holds no markers"),
        ("no_rig", {}, "no_rig.mcap: holds no config.json"),
        ("no_lens", {"config.json": kept["config.json"]}, "no_lens.mcap: holds no markers"),
    ):
        path = tmp_path / f"{name}.mcap"
        with RecordingWriter(path, "desk", "1", own):
            pass
        with pytest.raises(CaptureError, match=message), readable([str(path)]):
            pass


def test_one_video_without_a_rig_gives_markers_of_the_colour_asked_for(
    short_capture, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "calibration").mkdir()
    shutil.copy(short_capture / "calibration" / "right.colors.json", tmp_path / "calibration")
    source = f"right={short_capture / 'right.mkv'}"
    ran = CliRunner().invoke(
        application(), ["track", source, "--color", "blue", "--color", "lime", "--out", "out"]
    )
    assert ran.exit_code == 0, ran.stderr
    assert "note: markers only: 3D needs two cameras, this is 'right' alone" in ran.stderr
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert set(summary["cameras"]["right"]["colors"]) == {"blue", "lime"}
    ran = CliRunner().invoke(application(), ["export", "out"])
    assert ran.exit_code == 0, ran.stderr
    assert [path.name for path in (tmp_path / "out").glob("*.csv")] == ["markers.csv"]


def test_poses_of_objects_that_are_left_out_are_a_note(copy, tmp_path):
    lines = (copy / "objects.jsonl").read_text().splitlines(keepends=True)
    (copy / "objects.jsonl").write_text("".join([*lines, lines[3], lines[-1]]))
    summary = track([copy], tmp_path / "out")
    assert "poses of objects left out: 1 out of order, 1 repeated" in summary.notes
