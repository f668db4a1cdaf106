"""`rhot calibrate lens`: one camera's lens from pictures of a board, with its held-out error. Pure.

Pictures that contradict the others are left out and named. What cannot be calibrated - too few
pictures, a board never tilted, one corner of the image only - is refused with a CalibrationError
that says what is wrong and what to do: a lens that fits its pictures and is wrong elsewhere would
be worse than none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.adjust import Adjustment, FreeUnknowns, adjust
from services.calibrator.bundle.cross_validation import (
    adjust_without,
    folds,
    held_out_rms,
    leave_one_out,
    suspects,
)
from services.calibrator.bundle.lens_model import rays_from_pixels
from services.calibrator.bundle.residuals import View, rms, rms_by_board
from services.calibrator.bundle.views import single_view
from services.calibrator.lens.checks import check_fit, check_lens
from services.calibrator.lens.fit import fit_poses
from services.calibrator.lens.model_selection import LensModel, choose_model, only_free
from services.calibrator.lens.result import LensFit, LensResult, PictureError
from services.calibrator.lens.screening import fit_pictures


def calibrate_lens(camera: str, detections: dict[str, Detection], board: Board) -> LensResult:
    """Calibrate a camera's lens from the boards detected in its pictures (key -> detection).

    Raises CalibrationError, with the reason, if the pictures cannot support a calibration.
    """
    fit, left_out = fit_pictures(camera, detections, board)
    check_fit(fit)
    model = choose_model(lambda model: _held_out_px(fit, model))
    fit = replace(fit, found=_refit(fit, model))
    pictures = _picture_errors(fit, model, board)
    estimate = fit.estimate()
    held_out_squares = held_out_rms([picture.held_out_squares for picture in pictures])
    return LensResult(
        camera=camera,
        size_px=fit.size_px,
        lens=estimate.lens,
        sigma=estimate.sigma,
        coverage=estimate.coverage,
        model=model.name,
        rms_px=fit.found.rms_px,
        held_out_px=held_out_rms([picture.held_out_px for picture in pictures]),
        held_out_squares=held_out_squares,
        pictures=tuple(pictures),
        left_out=tuple(left_out),
        warnings=check_lens(estimate, held_out_squares),
    )


def _refit(fit: LensFit, model: LensModel) -> Adjustment:
    """The fit with another model, from the lens there is; what the model lacks is zero."""
    state = fit.found.state
    lens = np.where(model.free, state.lenses[0], 0.0)
    start = replace(state, lenses=lens[None])
    return adjust(fit.views, start, FreeUnknowns.one_lens(model.free))


def _held_out_px(fit: LensFit, model: LensModel) -> float:
    """RMS px over all pictures, each with the lens from the folds it is not in."""
    start = _refit(fit, model).state
    free = FreeUnknowns.one_lens(model.free)
    squares = []
    for held_out in folds(len(fit.views)):
        lens = adjust_without(fit.views, start, held_out, free).lenses[0]
        squares += [rms(_best_pose(lens, fit.views[k]).residuals[0]) ** 2 for k in held_out]
    return float(np.sqrt(np.mean(squares)))


def _picture_errors(fit: LensFit, model: LensModel, board: Board) -> list[PictureError]:
    errors_px = rms_by_board(fit.views, fit.found.residuals, len(fit.keys))
    without = leave_one_out(fit.views, fit.found, FreeUnknowns.one_lens(model.free))
    suspect = suspects(errors_px, [each.influence_percent for each in without])
    pictures = []
    for k, (key, view) in enumerate(zip(fit.keys, fit.views, strict=True)):
        lens = without[k].state.lenses[0]
        pose = _best_pose(lens, view)
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


def _best_pose(lens: Array, view: View) -> Adjustment:
    """The pose of one view's board that suits it best with this lens."""
    return fit_poses(lens, [single_view(view)], only_free())


def _distance_on_board_m(lens: Array, view: View, T_camera_from_board: Array) -> float:
    """RMS distance in metres between the corners and where the pixels' rays meet the board."""
    R, t = T_camera_from_board[:3, :3], T_camera_from_board[:3, 3]
    rays = rays_from_pixels(lens, view.pixels)
    directions = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ R  # board frame
    origin = -t @ R
    points = origin - directions * (origin[2] / directions[:, 2])[:, None]
    return rms(points - view.points)
