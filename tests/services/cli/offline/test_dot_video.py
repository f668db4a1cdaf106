"""`rhot track` of a video whose dots share a colour, as phones write it: every dot has its name."""

from __future__ import annotations

import msgspec
import pytest
from typer.testing import CliRunner

from rhot.files.capture import read_lines
from rhot.messages import MarkerFrame
from services.cli.application import application
from testing.dot_pictures import COLORS, DOTS, NAMES, SIZE, dot_picture, dot_places
from testing.phone_videos import write_phone_video

RIG = f"""
[[camera]]
name = "side"
size_px = [{SIZE[0]}, {SIZE[1]}]

[hand.right]
joints = "red"
fingers = ["thumb", "index"]
"""


@pytest.mark.parametrize("shown", [True, False], ids=["progress", "quiet"])
def test_every_dot_of_a_video_has_its_name_and_progress_goes_to_the_end(tmp_path, shown):
    pictures = [dot_picture(k, dot_places(k)).image[..., ::-1].copy() for k in range(21)]
    write_phone_video(tmp_path / "side.mp4", pictures, [k / 30 for k in range(21)])
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration" / "side.colors.json").write_bytes(msgspec.json.encode(COLORS))
    (tmp_path / "rig.toml").write_text(RIG)
    arguments = [f"side={tmp_path / 'side.mp4'}", "--config", str(tmp_path / "rig.toml")]
    progress = "--progress" if shown else "--no-progress"
    told = CliRunner().invoke(
        application(), ["track", *arguments, "--out", str(tmp_path / "result"), progress]
    )
    assert told.exit_code == 0, told.output
    frames = list(read_lines(tmp_path / "result" / "markers.jsonl", MarkerFrame))
    assert len(frames) == 21
    for number, frame in enumerate(frames):
        found = {marker.color: (marker.x_px, marker.y_px) for marker in frame.markers}
        assert set(found) == set(DOTS["red"].values()), number
        for name, (x, y) in zip(NAMES, dot_places(number), strict=True):
            assert found[f"red.{name}"] == pytest.approx((x, y), abs=4.0), (number, name)
