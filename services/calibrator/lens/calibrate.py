"""`rhot calibrate lens`: one camera's lens from pictures of a board, with its held-out error. Pure.

Pictures that contradict the others are left out and named. What cannot be calibrated - too few
pictures, a board never tilted, one corner of the image only - is refused with a CalibrationError
that says what is wrong and what to do: a lens that fits its pictures and is wrong elsewhere would
be worse than none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.files.calibration import LensKind
from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.cross_validation import held_out_rms, leave_one_out, suspects
from services.calibrator.bundle.lens_model import rays_from_pixels
from services.calibrator.bundle.residuals import View, rms, rms_by_board
from services.calibrator.lens.checks import check_fit, check_lens
from services.calibrator.lens.held_out import best_pose, free_unknowns, held_out_px, refit
from services.calibrator.lens.model_selection import LensModel, choose_model
from services.calibrator.lens.result import LensFit, LensResult, PictureError
from services.calibrator.lens.screening import fit_pictures


def calibrate_lens(
    camera: str, detections: dict[str, Detection], board: Board, kind: LensKind | None = None
) -> LensResult:
    """Calibrate a camera's lens from the boards detected in its pictures (key -> detection).

    kind is the lens model to use; None: the one with which held-out pictures fit better. Raises
    CalibrationError, with the reason, if the pictures cannot support a calibration.
    """
    fit, left_out = fit_pictures(camera, detections, board, kind)
    check_fit(fit)
    model = choose_model(lambda model: held_out_px(fit, model))
    fit = replace(fit, found=refit(fit, model))
    pictures = _picture_errors(fit, model, board)
    estimate = fit.estimate()
    held_out_squares = held_out_rms([picture.held_out_squares for picture in pictures])
    return LensResult(
        camera=camera,
        size_px=fit.size_px,
        lens=estimate.lens,
        sigma=estimate.sigma,
        coverage=estimate.coverage,
        model=model.name_of(fit.found.state.lenses),
        rms_px=fit.found.rms_px,
        held_out_px=held_out_rms([picture.held_out_px for picture in pictures]),
        held_out_squares=held_out_squares,
        pictures=tuple(pictures),
        left_out=tuple(left_out),
        warnings=check_lens(estimate, held_out_squares),
    )


def _picture_errors(fit: LensFit, model: LensModel, board: Board) -> list[PictureError]:
    errors_px = rms_by_board(fit.views, fit.found.residuals, len(fit.keys))
    without = leave_one_out(fit.views, fit.found, free_unknowns(fit, model))
    suspect = suspects(errors_px, [each.influence_percent for each in without])
    pictures = []
    for k, (key, view) in enumerate(zip(fit.keys, fit.views, strict=True)):
        lens = without[k].state.lenses[0]
        pose = best_pose(lens, view)
        on_board_m = _distance_on_board_m(lens, view, pose.state.T_rig_from_board[0])
        pictures.append(
            PictureError(
                key=key,
                rms_px=errors_px[k],
                held_out_px=rms(pose.residuals[0]),
                held_out_squares=on_board_m / board.square_m,
                influence_percent=without[k].influence_percent,
                suspect=suspect[k],
            )
        )
    return pictures


def _distance_on_board_m(lens: Array, view: View, T_camera_from_board: Array) -> float:
    """RMS distance in metres between the corners and where the pixels' rays meet the board."""
    R, t = T_camera_from_board[:3, :3], T_camera_from_board[:3, 3]
    rays = rays_from_pixels(lens, view.pixels)
    directions = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ R  # board frame
    origin = -t @ R
    points = origin - directions * (origin[2] / directions[:, 2])[:, None]
    return rms(points - view.points)
