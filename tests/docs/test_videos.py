"""The commands of docs/guide/videos.md, in its order, on a hand filmed by two phones.

The videos are as phones write them: H.264 at a variable rate, of two sizes, begun at two times. The
board's calibration is given: ffmpeg takes its pictures out of the videos, and others test the rest.
"""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path

import cv2
import msgspec
import pandas as pd
import pytest
from typer.testing import CliRunner

from rhot.files.config import load_rig
from services.cli.application import application
from services.cli.defaults import sim_toml
from services.simulator.files.capture_writer import write_capture
from services.simulator.scene.scene import load_scene
from testing.phone_pair import write_phone_pair
from testing.source_tree import ROOT

PAGE = (ROOT / "docs" / "guide" / "videos.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
LINES = [line for kind, block in BLOCKS if not kind for line in block.splitlines()]


def only_block(kind: str) -> str:
    (found,) = [block for one, block in BLOCKS if one == kind]
    return str(found)


def command_line(line: str) -> str:
    ran = CliRunner().invoke(application(), shlex.split(line)[1:])
    assert ran.exit_code == 0, f"{line}: {ran.stderr} {ran.exception}"
    return ran.output


@pytest.fixture(scope="module")
def outputs(tmp_path_factory) -> dict[str, str]:
    """What each command printed; under "" the folder, under "late" how late the right one began."""
    folder = tmp_path_factory.mktemp("videos")
    rig = load_rig(sim_toml())
    # A tracked cup stands about with paint that --auto would propose as well.
    slow = [msgspec.structs.replace(camera, fps=20.0) for camera in rig.camera]
    scene = load_scene(msgspec.structs.replace(rig, object=[], camera=slow), "wave", 1)
    # Shorter recordings do not tell how far the videos are apart.
    write_capture(scene, 5.0, folder / "capture")
    late_s = write_phone_pair(folder / "capture", folder / "filmed")
    (folder / "filmed" / "rig.toml").write_text(only_block("toml"))
    before, found = Path.cwd(), {"": str(folder / "filmed"), "late": f"{late_s}"}
    os.chdir(folder / "filmed")
    try:
        for line in LINES:
            if line.startswith("rhot ") and "stereo" not in line:
                found[line] = command_line(line)
    finally:
        os.chdir(before)
    return found


def test_only_the_board_s_commands_are_not_run(outputs):
    others = [line for line in LINES if line not in outputs]
    assert [line.split()[0] for line in others] == ["mkdir", "ffmpeg", "ffmpeg", "rhot"]
    assert others[-1].startswith("rhot calibrate stereo pictures")


def test_every_colour_is_found_in_both_videos(outputs):
    track = outputs["rhot track left=left.mp4 right=right.mp4 --config rig.toml --out result"]
    for color in ("violet", "magenta", "blue", "cyan", "green", "lime"):
        assert track.count(f"{color} ") == 2
    late = re.search(r"clock of right: right's times are ([\d.]+) s earlier", track)
    assert late is not None, track
    # To a millisecond, of 50 between two frames.
    assert float(late[1]) == pytest.approx(float(outputs["late"]), abs=1e-3)


def test_videos_and_tables_are_there(outputs, monkeypatch, capsys):
    folder = Path(outputs[""])
    for name, size in (("result/overlay_left", (480, 360)), ("result/overlay_right", (560, 420))):
        video = cv2.VideoCapture(str(folder / f"{name}.webm"))
        ok, picture = video.read()
        assert ok
        assert picture.shape[1::-1] == size
    assert (folder / "paths" / "overlay_cam.webm").is_file()
    markers = pd.read_csv(folder / "paths" / "markers.csv")
    assert set(markers.color) == {"blue", "magenta"}
    monkeypatch.chdir(folder)
    exec(compile(only_block("python"), "docs/guide/videos.md", "exec"), {})
    assert "mean" in capsys.readouterr().out


def test_angles_are_those_of_the_hand(outputs):
    """An open hand that waves: no joint is bent by more than 45 deg."""
    angles = pd.read_csv(Path(outputs[""]) / "result" / "angles.csv")
    assert len(angles) > 10
    assert (angles.index_status == "solved").mean() > 0.5
    assert angles.index_pip_deg.abs().median() < 45.0
