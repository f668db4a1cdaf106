"""A rig from pictures of a board: the files that `rhot calibrate stereo` writes, and a verdict."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import Lens, RigGeometry
from services.calibrator.board.board import Board
from services.calibrator.board.picture_folder import PictureSet
from services.calibrator.guided.boards import lens_found, rig_found
from testing.synthetic_boards import BenchSetup

DATE = "2026-11-02T10:00:00+01:00"
BOARD = Board(9, 6, 0.025)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[PictureSet, float]:
    """Pictures of eight positions by two cameras, and how far these are apart."""
    folder = tmp_path_factory.mktemp("boards")
    made = BenchSetup(
        positions=8, size_px=(320, 240), focal_px=263.0, distortion=(0.0,) * 5
    ).bench()
    files: dict[str, dict[str, Path]] = {}
    for camera in made.cameras:
        for key in made.poses:
            path = folder / f"{camera.name}_{key}.png"
            cv2.imwrite(str(path), made.picture(camera, key))
            files.setdefault(camera.name, {})[str(key)] = path
    left, right = (camera.T_rig_from_camera[:3, 3] for camera in made.cameras)
    return PictureSet(files), float(np.linalg.norm(right - left))


def test_a_rig_has_its_lenses_before_its_places(bench: tuple[PictureSet, float]) -> None:
    pictures, apart_m = bench
    found = rig_found(pictures, BOARD, None, DATE)
    assert list(found.files) == ["left.lens.json", "right.lens.json", "rig.json"]
    geometry = found.files["rig.json"]
    assert isinstance(geometry, RigGeometry)
    T = np.array(geometry.cameras["right"].T_rig_from_camera)
    assert np.linalg.norm(T[:3, 3]) == pytest.approx(apart_m, rel=0.02)
    figures = {one.name: one.value for one in found.figures}
    assert figures["cameras apart"] == f"{1e3 * np.linalg.norm(T[:3, 3]):.0f} mm"
    assert found.good == (not found.advice)
    # Lenses that are known stay as they are.
    lenses = {name: found.files[f"{name}.lens.json"] for name in ("left", "right")}
    assert all(isinstance(one, Lens) for one in lenses.values())
    again = rig_found(pictures, BOARD, lenses, DATE)  # type: ignore[arg-type]
    assert list(again.files) == ["rig.json"]


def test_a_board_that_moved_between_the_cameras_is_left_out_and_named(
    bench: tuple[PictureSet, float],
) -> None:
    pictures, _ = bench
    moved = {name: dict(files) for name, files in pictures.files.items()}
    key, other = list(moved["right"])[2:4]
    moved["right"][key] = moved["right"][other]
    found = rig_found(PictureSet(moved), BOARD, None, DATE)
    used = {one.name: one.value for one in found.figures}["positions of the board"]
    assert used.startswith("7 (")
    assert f"{key} left out: the cameras disagree by " in used


def test_too_few_pictures_are_refused(bench: tuple[PictureSet, float]) -> None:
    pictures, _ = bench
    one = dict(list(pictures.files["left"].items())[:1])
    with pytest.raises(CalibrationError):
        lens_found("left", PictureSet({"left": one}), BOARD, DATE)
