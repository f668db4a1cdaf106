"""Calibrations as the files other services read: <camera>.lens.json and rig.json, with date, tool,
inputs and residuals. Pure.

Numbers are rounded to what their sigma deserves, and nothing that is not finite gets into a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import CameraPlace, Lens, Matrix4, RigGeometry, Row3, lens_kind
from rhot.geometry.transforms import Array, inverse
from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, distortion_of, lens_vector
from services.calibrator.lens.result import LensResult
from services.calibrator.recalibrate.refine_rig import RefinedRig
from services.calibrator.rig.result import RigResult


class Provenance(NamedTuple):
    """How a calibration came about: date and tool, what went in, how well it fits."""

    date: str
    tool: str
    inputs: dict[str, Any]
    residuals: dict[str, float]


def lens_file(result: LensResult, board: Board, date: str, source: str) -> Lens:
    """<camera>.lens.json of `rhot calibrate lens`."""
    inputs = {
        **_board_inputs(board, source),
        "model": result.model,
        "pictures": len(result.pictures),
        "left_out": len(result.left_out),
    }
    residuals = {
        "rms_px": result.rms_px,
        "held_out_px": result.held_out_px,
        "held_out_squares": result.held_out_squares,
        "held_out_mm": 1e3 * board.square_m * result.held_out_squares,
        "focal_sigma_px": float(max(result.sigma[FX], result.sigma[FY])),
        "coverage": result.coverage.share,
    }
    made = Provenance(date, "rhot calibrate lens", inputs, residuals)
    return _lens(result.size_px, result.lens, made)


def rig_lens_files(result: RigResult, date: str, source: str) -> dict[str, Lens]:
    """<camera>.lens.json of every camera of `rhot calibrate stereo`.

    Empty if the lenses were given.
    """
    if result.lenses_given:
        return {}
    inputs = {
        **_board_inputs(result.board, source),
        "model": result.model,
        "positions": len(result.positions),
    }
    files = {}
    for k, name in enumerate(result.cameras):
        residuals = {
            "rms_px": result.camera_rms_px[k],
            "focal_sigma_px": float(result.lens_sigma[k, [FX, FY]].max()),
            "coverage": result.coverage[k].share,
        }
        made = Provenance(date, "rhot calibrate stereo", inputs, residuals)
        files[name] = _lens(result.sizes[k], result.state.lenses[k], made)
    return files


def _lens(size_px: tuple[int, int], lens: Array, made: Provenance) -> Lens:
    """A lens vector (9,) as <camera>.lens.json."""
    rows: tuple[Row3, Row3, Row3] = (
        (round(float(lens[FX]), 4), 0.0, round(float(lens[CX]), 4)),
        (0.0, round(float(lens[FY]), 4), round(float(lens[CY]), 4)),
        (0.0, 0.0, 1.0),
    )
    distortion = tuple(round(float(value), 7) for value in distortion_of(lens))
    return Lens(
        date=made.date,
        tool=made.tool,
        inputs=made.inputs,
        residuals=_finite(made.residuals),
        size_px=size_px,
        matrix=rows,
        distortion=distortion,
        model=lens_kind(distortion),
    )


def lens_vectors(
    files: dict[str, Lens], found: dict[str, dict[str, Detection]]
) -> dict[str, Array]:
    """The lens vectors (9,) of lens files, for the pictures in which boards were found.

    Raises CalibrationError if a lens is of another picture size.
    """
    for camera, lens in files.items():
        sizes = {shown.size_px for shown in found.get(camera, {}).values()} - {lens.size_px}
        if sizes:
            width, height = lens.size_px
            raise CalibrationError(
                f"camera {camera!r}: its lens was calibrated at {width}x{height}, these pictures "
                f"are {sorted(sizes)}; take pictures of that size, or leave out --keep-lenses"
            )
    return {
        camera: lens_vector(np.array(lens.matrix), np.array(lens.distortion))
        for camera, lens in files.items()
    }


def rig_file(result: RigResult, date: str, source: str) -> RigGeometry:
    """rig.json of `rhot calibrate stereo`."""
    inputs = {
        **_board_inputs(result.board, source),
        "model": result.model,
        "positions": len(result.positions),
        "left_out": [f"{item.camera} {item.key}".strip() for item in result.left_out],
    }
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
    extrinsics = {
        name: inverse(result.state.T_camera_from_rig[k]) for k, name in enumerate(result.cameras)
    }
    return _geometry(extrinsics, Provenance(date, "rhot calibrate stereo", inputs, residuals))


def refined_rig_file(result: RefinedRig, date: str, source: str, wand: str) -> RigGeometry:
    """rig.json of `rhot calibrate refine`."""
    inputs = {
        "markers_from": source,
        "wand": wand,
        "points": result.points,
        "seconds": round(result.seconds, 1),
    }
    residuals = {"epipolar_before_px": result.epipolar_before_px, "epipolar_px": result.epipolar_px}
    if result.wand_mm is not None:
        residuals |= {"wand_before_mm": result.wand_mm[0], "wand_mm": result.wand_mm[1]}
    extrinsics = {name: camera.T_rig_from_camera for name, camera in result.cameras.items()}
    return _geometry(extrinsics, Provenance(date, "rhot calibrate refine", inputs, residuals))


def _geometry(T_rig_from_camera: Mapping[str, Array], made: Provenance) -> RigGeometry:
    """The cameras' extrinsics (4, 4) by name as rig.json."""
    return RigGeometry(
        date=made.date,
        tool=made.tool,
        inputs=made.inputs,
        residuals=_finite(made.residuals),
        cameras={
            name: CameraPlace(T_rig_from_camera=rows(T)) for name, T in T_rig_from_camera.items()
        },
    )


def rows(T: Array) -> Matrix4:
    """A transform (4, 4) as rows of plain floats.

    Rounded to 1e-9, which keeps a rotation orthonormal and is a nanometre.
    """
    # Adding 0.0 turns -0.0 into 0.0.
    values = (np.round(T, 9) + 0.0).tolist()
    first, second, third, last = (tuple(row) for row in values)
    return (first, second, third, last)


def _board_inputs(board: Board, source: str) -> dict[str, Any]:
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
