"""Calibrations as the files other services read: <camera>.lens.json and rig.json, with date, tool,
inputs and residuals. Pure.

Numbers are rounded to what their sigma deserves, and nothing that is not finite gets into a file.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import CameraPlace, Lens, Matrix4, RigGeometry, Row3
from rhot.geometry.transforms import Array, inverse
from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, K1, lens_vector
from services.calibrator.lens.result import LensResult
from services.calibrator.recalibrate.refine_rig import Refined
from services.calibrator.rig.result import RigResult


def lens_file(
    size_px: tuple[int, int],
    lens: Array,
    date: str,
    tool: str,
    inputs: dict[str, Any],
    residuals: dict[str, Any],
) -> Lens:
    """A lens vector (9,) as <camera>.lens.json."""
    rows: tuple[Row3, Row3, Row3] = (
        (round(float(lens[FX]), 4), 0.0, round(float(lens[CX]), 4)),
        (0.0, round(float(lens[FY]), 4), round(float(lens[CY]), 4)),
        (0.0, 0.0, 1.0),
    )
    k1, k2, p1, p2, k3 = (round(float(value), 7) for value in lens[K1:])
    return Lens(
        date=date,
        tool=tool,
        inputs=inputs,
        residuals=residuals,
        size_px=size_px,
        matrix=rows,
        distortion=(k1, k2, p1, p2, k3),
    )


def lens_of(result: LensResult, board: Board, date: str, source: str) -> Lens:
    """<camera>.lens.json of `rhot calibrate lens`."""
    residuals = {
        "rms_px": result.rms_px,
        "held_out_px": result.held_out_px,
        "held_out_squares": result.held_out_squares,
        "held_out_mm": 1e3 * board.square_m * result.held_out_squares,
        "focal_sigma_px": float(max(result.sigma[FX], result.sigma[FY])),
        "coverage": result.coverage.share,
    }
    inputs = {
        **_inputs(board, source),
        "model": result.model,
        "pictures": len(result.pictures),
        "left_out": len(result.left_out),
    }
    return lens_file(
        result.size_px, result.lens, date, "rhot calibrate lens", inputs, _finite(residuals)
    )


def lenses_of(result: RigResult, date: str, source: str) -> dict[str, Lens]:
    """<camera>.lens.json of every camera of `rhot calibrate stereo`.

    Empty if the lenses were given.
    """
    if result.lenses_given:
        return {}
    files = {}
    for k, name in enumerate(result.cameras):
        residuals = {
            "rms_px": result.camera_rms_px[k],
            "focal_sigma_px": float(result.lens_sigma[k, [FX, FY]].max()),
            "coverage": result.coverage[k].share,
        }
        inputs = {
            **_inputs(result.board, source),
            "model": result.model,
            "positions": len(result.positions),
        }
        files[name] = lens_file(
            result.sizes[k],
            result.state.lenses[k],
            date,
            "rhot calibrate stereo",
            inputs,
            _finite(residuals),
        )
    return files


def given_lenses(
    files: dict[str, Lens], found: dict[str, dict[str, Detection]]
) -> dict[str, Array]:
    """The lens vectors (9,) of lens files, for the pictures in which boards were found.

    Raises CalibrationError if a lens is of another picture size.
    """
    for camera, lens in files.items():
        sizes = {shown.size_px for shown in found.get(camera, {}).values()} - {lens.size_px}
        if sizes:
            raise CalibrationError(
                f"camera {camera!r}: its lens was calibrated at {lens.size_px[0]}x{lens.size_px[1]}, these pictures are {sorted(sizes)}; "
                "take pictures of that size, or leave out --keep-lenses"
            )
    return {
        camera: lens_vector(np.array(lens.matrix), np.array(lens.distortion))
        for camera, lens in files.items()
    }


def rig_of(result: RigResult, date: str, source: str) -> RigGeometry:
    """rig.json of `rhot calibrate stereo`."""
    residuals = {
        "stereo_rms_px": result.rms_px,
        "held_out_squares": result.held_out_squares,
        "held_out_mm": 1e3 * result.board.square_m * result.held_out_squares,
        "held_out_px": result.held_out_px,
        "square_mm": 1e3 * result.board.square_m * result.square_ratio,
        "square_error_percent": 100.0 * (result.square_ratio - 1.0),
        "square_worst_percent": 100.0 * (result.square_worst - 1.0),
        "epipolar_px": result.epipolar_px,
    }
    inputs = {
        **_inputs(result.board, source),
        "model": result.model,
        "positions": len(result.positions),
        "left_out": [f"{item.camera} {item.key}".strip() for item in result.left_out],
    }
    cameras = {
        name: CameraPlace(T_rig_from_camera=rows(inverse(result.state.T_camera_from_rig[k])))
        for k, name in enumerate(result.cameras)
    }
    return RigGeometry(
        date=date,
        tool="rhot calibrate stereo",
        inputs=inputs,
        residuals=_finite(residuals),
        cameras=cameras,
    )


def refined_of(result: Refined, date: str, source: str, wand: str) -> RigGeometry:
    """rig.json of `rhot calibrate refine`."""
    residuals = {"epipolar_before_px": result.epipolar_before_px, "epipolar_px": result.epipolar_px}
    if result.wand_mm is not None:
        residuals |= {"wand_before_mm": result.wand_mm[0], "wand_mm": result.wand_mm[1]}
    inputs = {
        "markers_from": source,
        "wand": wand,
        "points": result.points,
        "seconds": round(result.seconds, 1),
    }
    cameras = {
        name: CameraPlace(T_rig_from_camera=rows(camera.T_rig_from_camera))
        for name, camera in result.cameras.items()
    }
    return RigGeometry(
        date=date,
        tool="rhot calibrate refine",
        inputs=inputs,
        residuals=_finite(residuals),
        cameras=cameras,
    )


def rows(T: Array) -> Matrix4:
    """A transform (4, 4) as rows of plain floats.

    1e-9 keeps a rotation orthonormal and is a nanometre.
    """
    # Adding 0.0 turns -0.0 into 0.0.
    values = (np.round(T, 9) + 0.0).tolist()
    first, second, third, last = (tuple(row) for row in values)
    return (first, second, third, last)


def _inputs(board: Board, source: str) -> dict[str, Any]:
    described: dict[str, Any] = {
        "board": f"{board.kind} {board.cols}x{board.rows}",
        "square_m": board.square_m,
        "pictures_from": source,
    }
    if board.kind == "charuco":
        described |= {"dictionary": board.dictionary, "marker_squares": board.marker}
    return described


def _finite(values: dict[str, float]) -> dict[str, float]:
    return {name: round(value, 6) for name, value in values.items() if math.isfinite(value)}
