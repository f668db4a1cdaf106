"""`rhot init` writes a rig.toml that its reader takes, says what comes next, overwrites none."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from rhot.files.config import load_rig
from rhot.files.rig_comments import comments_of
from rhot.files.rig_tables import Bus, CameraTable, HandTable
from services.cli.application import application
from services.cli.check.check import check_config
from services.cli.defaults import config_dir
from services.cli.init.choices import camera_choice, default_markers

RHOT = str(Path(sys.executable).parent / "rhot")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "new" / "rig.toml"


def init(*options):
    """The command's result, without a terminal."""
    return CliRunner().invoke(application(), ["init", *map(str, options)])


def test_the_defaults_are_two_pis_with_a_secured_bus(path):
    done = init(path, "--yes", "--master", "master.local")
    assert done.exit_code == 0, done.output
    rig = load_rig(path)
    assert [(camera.name, camera.host) for camera in rig.camera] == [
        ("left", "pi-left.local"),
        ("right", "pi-right.local"),
    ]
    assert rig.bus.connect == ("tcp/127.0.0.1:7447", "tls/master.local:7448")
    assert rig.bus.listen == ("tcp/127.0.0.1:7447", "tls/0.0.0.0:7448")
    assert rig.hand["right"].markers == default_markers(0)
    for command in ("rhot pki init", "rhot deploy pi-left.local", "rhot check", "rhot board"):
        assert command in done.output


def test_every_choice_reads_back(path):
    done = init(
        *(path, "--name", "bench", "--camera", "a=v4l2:0", "--camera", "b=picamera2:1@10.0.0.7"),
        *("--master", "10.0.0.1", "--hand", "both", "--fps", "60", "--size", "1280x960"),
        *("--markers", "wrist=violet,index_tip=blue", "--markers", "wrist=red"),
        *("--objects", "cup=LHR-1", "--objects", "fork=LHR-2"),
    )
    assert done.exit_code == 0, done.output
    rig = load_rig(path)
    assert rig.rig.name == "bench"
    assert [(c.name, c.source, c.host) for c in rig.camera] == [
        ("a", "v4l2:0", ""),
        ("b", "picamera2:1", "10.0.0.7"),
    ]
    assert {(camera.fps, camera.size_px) for camera in rig.camera} == {(60.0, (1280, 960))}
    assert rig.hand["right"].markers == {"wrist": "violet", "index_tip": "blue"}
    assert rig.hand["left"].markers == {"wrist": "red"}
    assert {one.name: one.serial for one in rig.object} == {"cup": "LHR-1", "fork": "LHR-2"}


def test_cameras_of_this_machine_alone_keep_the_bus_on_it(path):
    done = init(path, "--camera", "left=v4l2:0", "--camera", "right=v4l2:2")
    assert done.exit_code == 0, done.output
    assert load_rig(path).bus == Bus()
    assert "pki" not in done.output


def test_a_new_simulated_rig_has_no_mistake_but_missing_calibrations(path):
    cameras = ("--camera", "left=simulator", "--camera", "right=simulator", "--hand", "both")
    assert init(path, *cameras).exit_code == 0
    errors = [one for one in check_config(path).problems if one.severity == "error"]
    assert errors
    assert all("calibration" in one.where for one in errors)


def test_every_line_that_is_no_key_is_a_comment_of_the_tables(path):
    init(path, "--yes", "--master", "master.local")
    text = " ".join(line.strip("# ") for line in path.read_text().splitlines())
    for table, key in ((Bus, "listen"), (CameraTable, "host"), (HandTable, "markers")):
        assert comments_of(table)[key] in text


def test_the_example_that_comes_along_is_what_it_writes(path):
    pis = ("--camera", "left=pi-left.local", "--camera", "right=pi-right.local")
    init(path, *pis, "--master", "192.168.1.10", "--objects", "cup=LHR-12345678")
    assert (config_dir() / "rig.example.toml").read_text() == path.read_text()


def test_what_is_there_is_never_overwritten(path):
    assert init(path, "--yes").exit_code == 0
    before = path.read_bytes()
    again = init(path.parent, "--yes")
    assert "is there already" in str(again.exception)
    assert path.read_bytes() == before
    assert sorted(file.name for file in path.parent.iterdir()) == ["rig.toml"]


@pytest.mark.parametrize(
    ("options", "part"),
    [
        (("--camera", "left"), "is no camera; write NAME=HOST"),
        (("--camera", "left=a b"), "is no camera"),
        (("--camera", "l=v4l2:0", "--camera", "l=v4l2:1"), "a name of its own"),
        (("--hand", "middle"), "valid: right, left, both, none"),
        (("--markers", "wrst=red"), "did you mean 'wrist'?"),
        (("--markers", "wrist=red,thumb_tip=red"), "once only"),
        (("--markers", "wrist=red", "--markers", "wrist=blue"), "for 1 hands"),
        (("--hand", "both", "--markers", "wrist=red"), "used twice"),
        (("--size", "640"), "write WIDTHxHEIGHT"),
        (("--size", "640x9000"), "`camera[0].size_px"),
        (("--fps", "0"), "is no frame rate"),
        (("--objects", "cup"), "write it like cup=LHR-12345678"),
        (("--name", "my rig"), "is no name"),
        (("--master", "a b"), "is no host"),
    ],
)
def test_what_cannot_be_is_told_and_nothing_is_written(path, options, part):
    done = init(path, *options)
    assert done.exit_code != 0
    assert part in str(done.exception)
    assert not path.exists()
    assert not path.parent.exists() or not list(path.parent.iterdir())


def test_a_camera_that_is_typed():
    assert camera_choice("left=pi-left.local").source == "picamera2"
    assert camera_choice("left=v4l2:/dev/video0@10.0.0.7").host == "10.0.0.7"
    assert camera_choice("left=video:l@home.mp4") != camera_choice("left=l.mp4")


def test_questions_on_a_terminal_ask_again_after_a_wrong_answer(path):
    """A real terminal: wrong name, two local cameras, then defaults."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "COLUMNS": "200"}
    with subprocess.Popen(
        [RHOT, "init", str(path)], stdin=theirs, stdout=theirs, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        os.write(ours, b"my rig\ndesk2\nleft=v4l2:0 right=v4l2:2\nleft\n\n\n\n\n")
        said = b""
        try:
            while chunk := os.read(ours, 65536):
                said += chunk
        except OSError:  # the other end is closed
            pass
    os.close(ours)
    assert process.returncode == 0, said.decode()
    assert b"is no name" in said
    rig = load_rig(path)
    assert (rig.rig.name, list(rig.hand)) == ("desk2", ["left"])
    assert [camera.source for camera in rig.camera] == ["v4l2:0", "v4l2:2"]
