"""`rhot calibrate lens | stereo | world | depth` and `rhot board` as a user types them."""

from __future__ import annotations

import json
import tomllib

import cv2
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from rhot.errors import CalibrationError
from rhot.files.calibration import CameraPlace, Lens, RigGeometry, load_cameras, load_lens, save
from rhot.files.capture import write_lines
from rhot.geometry.transforms import rotation_x, transform
from services.cli.calibrate.board import board
from services.cli.calibrate.calibrate import calibrate
from testing.synthetic_points import MovingHand, SyntheticRig, frames

RIG_TOML = '[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n'


@pytest.fixture
def run():
    """Runs `rhot calibrate ...`; an error of ours is raised."""

    def invoke(*arguments: object):
        return CliRunner().invoke(
            calibrate, [str(argument) for argument in arguments], catch_exceptions=False
        )

    return invoke


@pytest.fixture(scope="module")
def folder(make_bench, tmp_path_factory):
    """Rendered pairs left01.png, right01.png, ... and one picture without a board."""
    bench = make_bench(
        positions=6, size_px=(400, 300), focal_px=330.0, distortion=(-0.2, 0.05, 0.0, 0.0, 0.0)
    )
    made = tmp_path_factory.mktemp("pictures")
    for camera in bench.cameras:
        for key in bench.poses:
            cv2.imwrite(str(made / f"{camera.name}{key}.png"), bench.picture(camera, key))
    cv2.imwrite(str(made / "left99.png"), np.full((300, 400), 90, dtype=np.uint8))
    return bench, made


@pytest.fixture
def blank(tmp_path_factory):
    """Pairs of grey pictures."""
    made = tmp_path_factory.mktemp("blank")
    for name in ("left1", "left2", "right1", "right2"):
        cv2.imwrite(str(made / f"{name}.png"), np.full((120, 160), 90, dtype=np.uint8))
    return made


def test_stereo_writes_what_services_read(run, folder, tmp_path):
    bench, pictures = folder
    out = tmp_path / "calibration"
    result = run("stereo", pictures, "--square", 0.025, "--out", out)
    assert result.exit_code == 0
    assert "held-out board fit" in result.stdout
    assert "chessboard 9x6, 25 mm squares" in result.stdout
    assert "left out: left 99: does not show the whole board" in result.stdout
    cameras = load_cameras(out, ["left", "right"])
    np.testing.assert_allclose(cameras["right"].centre_rig, bench.cameras[1].centre_rig, atol=1e-3)
    assert cameras["left"].focal_px[0] == pytest.approx(330.0, rel=5e-3)


def test_stereo_says_when_the_squares_were_assumed_and_prints_json(run, folder, tmp_path):
    _, pictures = folder
    result = run("stereo", pictures, "--board", "9x6", "--out", tmp_path, "--json")
    assert json.loads(result.stdout)["inputs"]["square_m"] == 0.025
    assert "25 mm were assumed" in result.stderr
    again = run(
        "stereo",
        pictures,
        "--board",
        "9x6",
        "--square",
        0.05,
        "--out",
        tmp_path,
        "--keep-lenses",
        "--json",
    )
    residuals = json.loads(again.stdout)["residuals"]
    assert residuals["square_mm"] == pytest.approx(50.0, rel=5e-3)
    assert np.linalg.norm(load_cameras(tmp_path, ["right"])["right"].centre_rig) == pytest.approx(
        0.15, rel=0.02
    )


def test_lens_writes_one_file(run, folder, tmp_path):
    _, pictures = folder
    result = run("lens", "right", pictures, "--board", "9x6", "--square", 0.025, "--out", tmp_path)
    assert "camera right, 400x300 px, 6 pictures" in result.stdout
    assert load_lens(tmp_path, "right").matrix[0][0] == pytest.approx(333.3, rel=5e-3)
    assert [path.name for path in tmp_path.iterdir()] == ["right.lens.json"]


def test_refused_data_write_nothing(run, folder, blank, tmp_path):
    _, pictures = folder
    with pytest.raises(CalibrationError, match="no picture of 'left', 'right' shows the board"):
        run("stereo", blank, "--board", "9x6", "--out", tmp_path)
    with pytest.raises(CalibrationError, match="no picture shows a chessboard"):
        run("stereo", blank, "--out", tmp_path)
    with pytest.raises(CalibrationError, match="in metres"):
        run("stereo", pictures, "--board", "9x6", "--square", 25, "--out", tmp_path)
    with pytest.raises(CalibrationError, match="--config"):
        run("stereo", pictures, "--live", "--out", tmp_path)
    with pytest.raises(CalibrationError, match="give its inner corners"):
        run("lens", "left", pictures, "--kind", "charuco", "--out", tmp_path)
    assert not list(tmp_path.iterdir())


def test_world_prints_the_table_for_rig_toml(run, folder, tmp_path, make_bench):
    """Test: calibrate, then a board on the desk.

    Expected: [rig.world] with the camera above the desk.
    """
    bench, pictures = folder
    config = tmp_path / "rig.toml"
    config.write_text(RIG_TOML)
    run("stereo", pictures, "--board", "9x6", "--square", 0.025, "--config", config)
    desk = tmp_path / "desk"
    desk.mkdir()
    lying = transform(rotation_x(np.radians(-40.0)), [-0.08, -0.02, 0.5])
    scene = type(bench)(bench.cameras, bench.board, {"desk": lying})
    for camera in bench.cameras:
        cv2.imwrite(str(desk / f"{camera.name}.png"), scene.picture(camera, "desk"))
    result = run("world", desk, "--config", config, "--board", "9x6", "--square", 0.025)
    T = np.array(tomllib.loads(result.stdout)["rig"]["world"]["T_rig_from_camera"])
    truth = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(lying)
    np.testing.assert_allclose(T[:3, 3], truth[:3, 3], atol=4e-3)
    with pytest.raises(CalibrationError, match="holds no pictures"):
        run("world", tmp_path / "calibration", "--config", config)


def test_depth_fits_a_table_or_the_simulated_bench(run, tmp_path):
    result = run("depth", "--simulate", "--divergence-deg", 0.095, "--zero-mm", 10.2)
    assert "RHOT eq. (9)" in result.stdout
    law = json.loads(run("depth", "--simulate", "--json").stdout)
    table = tmp_path / "bench.csv"
    rows = zip(law["distances_cm"], law["disparities_px"], strict=True)
    table.write_text(
        "distance_cm,disparity_px\n"
        + "".join(f"{distance},{disparity}\n" for distance, disparity in rows)
    )
    assert json.loads(run("depth", table, "--json").stdout)["k"] == pytest.approx(law["k"])
    with pytest.raises(CalibrationError, match="--simulate"):
        run("depth")


def test_board_writes_a_pdf_and_says_how_to_use_it(tmp_path):
    app = typer.Typer()
    app.command()(board)
    path = tmp_path / "new" / "board.pdf"
    result = CliRunner().invoke(
        app,
        [
            "--kind",
            "charuco",
            "--cols",
            "7",
            "--rows",
            "5",
            "--square-mm",
            "30",
            "--out",
            str(path),
        ],
    )
    assert path.read_bytes().startswith(b"%PDF")
    assert "--board 7x5 --square 0.03 --kind charuco" in result.stdout


def test_refine_writes_the_places_that_a_hand_tells(run, tmp_path):
    """The right camera stands half a degree and 2 mm off its rig.json.

    The report says so, and services read the new file.
    """
    setup = SyntheticRig(sigma_px=0.15)
    true = setup.rig()
    (tmp_path / "rig.toml").write_text(RIG_TOML)
    turn = transform(rotation_x(np.radians(0.5)), (0.0, 0.002, 0.0))
    places = {}
    for name, camera in true.items():
        rows = tuple(tuple(row) for row in camera.matrix.tolist())
        save(
            tmp_path / "calibration" / f"{name}.lens.json",
            Lens(size_px=camera.size_px, matrix=rows, distortion=tuple(camera.distortion.tolist())),
        )
        T = camera.T_rig_from_camera @ turn if name == "right" else camera.T_rig_from_camera
        places[name] = CameraPlace(T_rig_from_camera=tuple(tuple(row) for row in T.tolist()))
    save(tmp_path / "calibration" / "rig.json", RigGeometry(cameras=places))
    write_lines(
        tmp_path / "markers.jsonl",
        frames(setup, MovingHand(distance_m=0.6, speed_m_s=0.6, hand_hz=(0.2, 0.6)), 8.0),
    )
    result = run("refine", tmp_path, "--config", tmp_path / "rig.toml")
    assert result.exit_code == 0
    assert "held-out epipolar" in result.stdout
    assert "camera right: turned about its x, y, z by -0.50" in result.stdout
    found = load_cameras(tmp_path / "calibration", ["left", "right"])["right"].T_rig_from_camera
    np.testing.assert_allclose(found[:3, :3], true["right"].T_rig_from_camera[:3, :3], atol=1e-3)
    assert (
        json.loads((tmp_path / "calibration" / "rig.json").read_text())["residuals"][
            "epipolar_before_px"
        ]
        > 3.0
    )


def test_refine_explains_a_wand_it_does_not_understand(run, tmp_path):
    (tmp_path / "rig.toml").write_text(RIG_TOML)
    with pytest.raises(CalibrationError, match="write two colours"):
        run("refine", tmp_path, "--config", tmp_path / "rig.toml", "--wand", "blue-green")
