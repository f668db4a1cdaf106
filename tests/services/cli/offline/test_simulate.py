"""`rhot simulate`: a thin command over the simulator's capture writer."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from rhot.errors import ConfigError
from rhot.files.capture import Capture, read_lines, read_stamps
from rhot.files.config import load_rig
from rhot.messages.simulator import Truth
from services.cli.application import application
from services.simulator.scene.catalog import ALSO, SCENES


def simulate(*arguments):
    return CliRunner().invoke(application(), ["simulate", *map(str, arguments)])


def test_a_capture_is_written_at_the_wanted_rate(tmp_path):
    ran = simulate(
        "wave",
        "--seconds",
        0.3,
        "--seed",
        4,
        "--fps",
        60,
        "--speed",
        2,
        "--out",
        tmp_path / "c",
        "--json",
    )
    assert ran.exit_code == 0
    printed = json.loads(ran.stdout)
    capture = Capture(tmp_path / "c")
    assert load_rig(capture.rig_toml).camera[0].fps == 60
    count = sum(len(read_stamps(capture.stamps(name))) for name in ("left", "right"))
    assert printed["pictures"] == count
    assert 30 <= count <= 36
    assert printed["scene"] == "wave"
    assert printed["seed"] == 4
    assert next(read_lines(capture.truth, Truth)).hands["right"].points_m["index_tip"]
    assert ran.stderr == ""


def test_scenes_are_listed():
    assert all(name in simulate("--list").stdout for name in (*SCENES, *ALSO))
    assert set(json.loads(simulate("--list", "--json").stdout)) == {*SCENES, *ALSO}


def test_an_unknown_scene_or_a_missing_folder_says_what_is_valid(tmp_path):
    for arguments, text in (
        (("fits", "--out", tmp_path / "c"), "did you mean 'fist'"),
        (("fist",), "needs a scene and a folder"),
    ):
        error = simulate(*arguments).exception
        assert isinstance(error, ConfigError)
        assert text in str(error)
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    "option", [("--seconds", "0"), ("--fps", "0"), ("--seed", "-1"), ("--speed", "99")]
)
def test_absurd_values_are_refused(tmp_path, option):
    assert simulate("fist", "--out", tmp_path / "c", *option).exit_code == 2
