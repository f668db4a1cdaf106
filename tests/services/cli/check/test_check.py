"""`rhot check` finds everything at once, and says nothing where there is nothing to say."""

from __future__ import annotations

import json
import shutil

import msgspec
import pytest
from typer.testing import CliRunner

from rhot.files.calibration import ColorRange, Lens, load_geometry, load_lens, save
from services.cli.application import application
from services.cli.check.check import check_config
from services.cli.check.colors import overlap
from services.cli.defaults import config_dir, sim_toml


@pytest.fixture
def rig(tmp_path):
    """A copy of the simulated rig to break."""
    shutil.copytree(config_dir(), tmp_path / "rig")
    return tmp_path / "rig" / "sim.toml"


def texts(path, severity="error"):
    return [
        f"{problem.where}: {problem.what}"
        for problem in check_config(path).problems
        if problem.severity == severity
    ]


def append(path, text):
    path.write_text(path.read_text() + "\n" + text)


def replace(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_the_rigs_that_come_along_are_sound():
    assert texts(sim_toml()) == []
    example = check_config(config_dir() / "rig.example.toml")
    assert all(
        "calibration" in problem.where or "pki" in problem.where or problem.severity != "error"
        for problem in example.problems
    )


def test_every_mistake_of_a_file_is_told_at_once(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(
        """
[rig]
nam = "x"
[[camera]]
name = "left"
fps = "30"
size_px = [640, 4]
[[camera]]
source = "picamera2"
[[camera]]
name = "left"
[hand.middle.markers]
wrist = "red"
[hand.right.markers]
wrst = "lime"
wrist = "red"
index_tip = "red"
thumb_tip = 3
[fusion]
method = "kalmann"
[fusion.one_euro]
beta = -1
[bogus]
x = 1
"""
    )
    found = "\n".join(texts(path))
    for part in (
        "unknown key `nam`, did you mean `name`?",
        "`camera[0].fps`: expected `float`, got `str`",
        "`camera[0].size_px`",
        "[camera[1]]: `name` is missing",
        "unknown key `middle`. Valid: left, right",
        "unknown landmark `wrst`, did you mean `wrist`?",
        "`hand.right.markers.thumb_tip`",
        "colour 'red' is used twice, once for wrist",
        "'left' is used 2 times",
        "'kalmann'; valid: disparity, kalman, triangulate",
        "`fusion.one_euro.beta`",
        "unknown key `bogus`",
    ):
        assert part in found


@pytest.mark.parametrize(("text", "part"), [("[rig", "not valid TOML"), (None, "no such file")])
def test_a_file_that_cannot_be_read_is_one_problem(tmp_path, text, part):
    path = tmp_path / "rig.toml"
    if text is not None:
        path.write_text(text)
    (problem,) = check_config(path).problems
    assert part in problem.what


def test_missing_calibrations_come_with_the_command_that_makes_them(rig):
    shutil.rmtree(rig.parent / "calibration")
    found = "\n".join(texts(rig))
    for part in (
        "left.lens.json",
        "right.colors.json",
        "rig.json",
        "rhot calibrate lens left",
        "rhot calibrate colors right",
    ):
        assert part in found
    assert any("lighthouse frame" in text for text in texts(rig, "warning"))


def test_a_broken_calibration_is_named(rig):
    (rig.parent / "calibration" / "rig.json").write_text("{")
    assert any("rig.json" in text and "rhot calibrate stereo" in text for text in texts(rig))


def test_a_colour_that_is_not_calibrated(rig):
    replace(rig, '"blue"', '"purple"')
    found = texts(rig)
    assert any("'purple'" in text and "left.colors.json" in text for text in found)
    assert any("'purple'" in text and "right.colors.json" in text for text in found)


def test_ranges_that_overlap_are_a_warning(rig):
    path = rig.parent / "calibration" / "left.colors.json"
    colors = json.loads(path.read_text())
    colors["colors"]["blue"] = colors["colors"]["green"]
    path.write_text(json.dumps(colors))
    assert any(
        "'blue'" in text and "'green'" in text and "overlap" in text
        for text in texts(rig, "warning")
    )


@pytest.mark.parametrize(
    ("a", "b", "both"),
    [
        (((0, 50, 50), (20, 255, 255)), ((20, 50, 50), (40, 255, 255)), True),
        (((0, 50, 50), (19, 255, 255)), ((20, 50, 50), (40, 255, 255)), False),
        (((170, 50, 50), (5, 255, 255)), ((4, 50, 50), (40, 255, 255)), True),
        (((170, 50, 50), (5, 255, 255)), ((6, 50, 50), (169, 255, 255)), False),
        (((170, 50, 50), (5, 255, 255)), ((178, 0, 0), (2, 49, 255)), False),
        (((170, 50, 50), (5, 255, 255)), ((178, 0, 0), (2, 50, 255)), True),
    ],
)
def test_overlap_of_ranges_minds_the_wrap_of_hue(a, b, both):
    ranges = [ColorRange(hsv_low=low, hsv_high=high) for low, high in (a, b)]
    assert overlap(*ranges) is both
    assert overlap(*reversed(ranges)) is both


def test_a_lens_of_another_picture_size(rig):
    replace(rig, 'name = "left"', 'name = "left"\nsize_px = [1280, 960]')
    assert any("640 x 480" in text and "1280 x 960" in text for text in texts(rig))


def test_a_camera_without_a_place_and_cameras_in_one_place(rig):
    folder = rig.parent / "calibration"
    geometry = load_geometry(folder)
    save(
        folder / "rig.json",
        msgspec.structs.replace(geometry, cameras={"left": geometry.cameras["left"]}),
    )
    assert any("'right' is missing" in text for text in texts(rig))
    save(
        folder / "rig.json",
        msgspec.structs.replace(
            geometry, cameras=dict.fromkeys(("left", "right"), geometry.cameras["left"])
        ),
    )
    assert any("0.0 mm apart" in text for text in texts(rig))


@pytest.mark.parametrize(
    ("source", "part"),
    [
        ("video:gone.mp4", "there is no file"),
        ("folder:gone", "there is no folder"),
        ("capture:.", "has no left.mkv"),
        ("v4l2:/dev/no-such-camera", "there is no /dev/no-such-camera"),
        ("webcam", "is no source; valid: picamera2"),
        ("simulator:3", "is no source"),
    ],
)
def test_sources_that_do_not_exist(rig, source, part):
    replace(rig, 'name = "left"\nsource = "simulator"', f'name = "left"\nsource = "{source}"')
    assert any(part in text for text in texts(rig))


def test_a_camera_of_another_host_is_not_looked_for_here(rig):
    replace(
        rig,
        'name = "left"\nsource = "simulator"',
        'name = "left"\nsource = "v4l2:/dev/no-such-camera"\nhost = "pi"',
    )
    found = texts(rig)
    assert not any("/dev/no-such-camera" in text for text in found)
    # But the router must then be reachable from there.
    assert any("only this machine can reach the router" in text for text in found)


def test_markers_of_one_camera_are_no_error(rig):
    replace(rig, '[[camera]]\nname = "right"\nsource = "simulator"', "")
    for name in ("rig.json", "left.lens.json"):
        (rig.parent / "calibration" / name).unlink()
    assert texts(rig) == []
    assert any("needs two for depth" in text for text in texts(rig, "note"))


def test_a_hand_without_a_camera_is_one(rig):
    text = rig.read_text()
    rig.write_text(text[: text.index("[[camera]]")] + "[hand.right.markers]\nwrist = 'violet'")
    assert any("two cameras" in text for text in texts(rig))


def test_an_object_that_is_not_registered(rig):
    append(rig, '[[object]]\nname = "fork"\nserial = "LHR-2"')
    assert any("'fork'" in text for text in texts(rig, "warning"))


def test_a_router_open_to_the_network_is_a_warning(rig):
    append(rig, '[bus]\nlisten = ["tcp/0.0.0.0:7447"]')
    assert any("has no certificates" in text for text in texts(rig))
    append(rig, 'access = "open"')
    assert any("without protection" in text for text in texts(rig, "warning"))
    replace(rig, "tcp/0.0.0.0:7447", "tls/0.0.0.0:7447")
    assert any("rhot pki" in text for text in texts(rig))
    assert not any("without protection" in text for text in texts(rig, "warning"))
    replace(rig, "tls/0.0.0.0:7447", "0.0.0.0")
    assert any("is no endpoint" in text for text in texts(rig))


def test_a_router_that_listens_where_nobody_looks(rig):
    assert not any("wait for ever" in text for text in texts(rig, "warning"))
    append(rig, '[bus]\nlisten = ["tcp/127.0.0.1:7450", "tls/0.0.0.0:7448"]')
    (told,) = [text for text in texts(rig, "warning") if "wait for ever" in text]
    assert "tcp/127.0.0.1:7447" in told
    append(rig, 'connect = ["tls/master.local:7448"]')
    assert not any("wait for ever" in text for text in texts(rig, "warning"))


def test_an_unknown_scene_and_a_port_used_twice(rig):
    replace(rig, 'scene = "piano"', 'scene = "pianio"')
    append(rig, "[viewer]\nport = 7447")
    found = "\n".join(texts(rig))
    assert "did you mean 'piano'?" in found
    assert "is the router's port" in found


def test_a_world_that_is_no_rigid_transform(rig):
    append(rig, "[rig.world]\nT_rig_from_camera = [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")
    assert any("is not a rotation" in text for text in texts(rig))


def test_a_model_of_the_other_hand(rig):
    lens = load_lens(rig.parent / "calibration", "left")
    assert isinstance(lens, Lens)
    save(rig.parent / "calibration" / "hand.right.json", lens)
    assert any("hand.right.json" in text for text in texts(rig))


def test_the_command_prints_and_exits_accordingly(rig):
    run = CliRunner().invoke
    sound = run(application(), ["check", str(rig)])
    assert sound.exit_code == 0
    assert "0 errors" in sound.stdout
    append(rig, '[bus]\nlisten = ["tcp/0.0.0.0:7447"]\naccess = "open"')
    assert run(application(), ["check", str(rig)]).exit_code == 0
    assert run(application(), ["check", "--strict", str(rig)]).exit_code == 1
    append(rig, "[bogus]")
    broken = run(application(), ["check", "--json", str(rig)])
    assert broken.exit_code == 1
    assert json.loads(broken.stdout)["problems"][0]["severity"] == "error"
