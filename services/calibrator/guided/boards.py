"""A calibrated lens or rig, judged and told in plain words. Pure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.files.calibration import Lens
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.find_boards import find_boards
from services.calibrator.board.picture_folder import PictureSet
from services.calibrator.guided.found import Found, figure
from services.calibrator.lens.calibrate import calibrate_lens
from services.calibrator.output.calibration_files import (
    lens_file,
    lens_vectors,
    rig_file,
    rig_lens_files,
)
from services.calibrator.rig.calibrate import calibrate_rig


def lens_found(camera: str, pictures: PictureSet, board: Board, date: str) -> Found:
    """The lens of a camera from pictures of a board; raises CalibrationError for too few."""
    detections, unseen = find_boards(pictures, board)
    result = calibrate_lens(camera, detections[camera], board, None)
    held_out_mm = 1e3 * board.square_m * result.held_out_squares
    covered = f"{100 * result.coverage.share:.0f} % of the picture"
    return Found(
        files={f"{camera}.lens.json": lens_file(result, board, date, "the page")},
        good=not result.warnings,
        figures=[
            figure("error of pictures that were left out", f"{result.held_out_px:.2f} px"),
            figure("the same on the board", f"{held_out_mm:.2f} mm"),
            figure("error in the fit", f"{result.rms_px:.2f} px"),
            figure("covered by corners", covered),
            figure("farthest tilt of the board", f"{max(result.coverage.tilt_deg):.0f}°"),
            figure("pictures used", _used(len(result.pictures), [*unseen, *result.left_out])),
        ],
        advice=list(result.warnings),
    )


def rig_found(
    pictures: PictureSet, board: Board, lenses: dict[str, Lens] | None, date: str
) -> Found:
    """Where cameras stand, with the lenses that they have, or (None) with these found as well."""
    detections, unseen = find_boards(pictures, board)
    given = lens_vectors(lenses, detections) if lenses else None
    result = calibrate_rig(detections, board, given, None)
    own = {} if lenses else rig_lens_files(result, date, "the page")
    square_mm = 1e3 * board.square_m
    first, *others = result.state.T_camera_from_rig
    apart_mm = [1e3 * float(np.linalg.norm(T[:3, 3] - first[:3, 3])) for T in others]
    problems = [*result.doubts(), *result.warnings]
    left_out = [*unseen, *result.left_out]
    return Found(
        # Last the places: they are never beside older lenses.
        files={f"{name}.lens.json": made for name, made in own.items()}
        | {"rig.json": rig_file(result, date, "the page")},
        good=not problems,
        figures=[
            figure("error across the cameras, left out", f"{result.epipolar_px:.2f} px"),
            figure(
                "the board, measured by the cameras",
                f"{square_mm * result.square_ratio:.2f} mm a square of {square_mm:g} mm",
            ),
            figure("error in the fit", f"{result.rms_px:.2f} px"),
            figure("cameras apart", ", ".join(f"{one:.0f} mm" for one in apart_mm)),
            figure("positions of the board", _used(len(result.positions), left_out)),
        ],
        advice=problems,
    )


def _used(count: int, left_out: Sequence[LeftOut]) -> str:
    """How many were used, and why the others were not."""
    reasons = "; ".join(f"{item.key} left out: {item.reason}" for item in left_out)
    return f"{count} ({reasons})" if reasons else str(count)
