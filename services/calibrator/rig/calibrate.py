"""`rhot calibrate stereo`: lenses and extrinsics of 2..N cameras from a board seen together. Pure.

First each camera's lens from its own pictures, then pairs of cameras, then one adjustment of
everything. Every position of the board is left out once, and the calibration from the others
triangulates it: the report's figures are those held-out errors. Pictures that contradict the others
are left out and named. Data that cannot support a calibration are refused with a CalibrationError
that says why.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.files.calibration import LensKind
from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.detect import Detections
from services.calibrator.bundle.adjust import FreeUnknowns, adjust
from services.calibrator.bundle.cross_validation import (
    adjust_without,
    folds,
    leave_one_out,
    suspects,
)
from services.calibrator.bundle.outliers import OUTLIER_ROUNDS, outliers
from services.calibrator.bundle.views import subset, views_of_board
from services.calibrator.lens.model_selection import USUAL_MODEL, LensModel, choose_model
from services.calibrator.rig.checks import check_cameras, check_rig
from services.calibrator.rig.held_out_error import held_out_error, held_out_fit_squares
from services.calibrator.rig.initial_rig import initial_rig
from services.calibrator.rig.result import PositionError, RigFit, RigResult, rig_result


def calibrate_rig(
    detections: Detections,
    board: Board,
    lenses: dict[str, Array] | None = None,
    kind: LensKind | None = None,
) -> RigResult:
    """Calibrate a rig from the boards in each camera's pictures; equal keys are one instant.

    lenses (camera -> (9,)) are taken as they are if given, else found as well: of that kind, or
    each of the one with which held-out pictures fit better. The first camera is the rig frame.
    Raises CalibrationError, with the reason, if the pictures cannot support a
    calibration.
    """
    check_cameras(detections)
    start, left_out = initial_rig(detections, board, lenses, kind)
    # None: the lenses are held.
    model = USUAL_MODEL if lenses is None else None
    fit, outlier_positions = _adjust_without_outliers(start, _free_unknowns(start, model))
    if model is not None:
        model = choose_model(lambda model: _held_out_squares(fit, board, model))
        fit = _refit(fit, model)
    positions = _position_errors(fit, board, _free_unknowns(fit, model))
    name = model.name_of(fit.found.state.lenses) if model else None
    result = rig_result(fit, board, positions, [*left_out, *outlier_positions], name)
    return replace(result, warnings=check_rig(result))


def _free_unknowns(fit: RigFit, model: LensModel | None) -> FreeUnknowns:
    """All boards, all cameras but the first, and the numbers of their lenses the model has."""
    lenses = fit.found.state.lenses
    free = model.free_of(lenses) if model else np.zeros_like(lenses, dtype=bool)
    return FreeUnknowns(free, np.arange(len(lenses)) > 0)


def _adjust_without_outliers(fit: RigFit, free: FreeUnknowns) -> tuple[RigFit, list[LeftOut]]:
    """Adjust everything, and leave out positions that contradict the others."""
    left_out: list[LeftOut] = []
    fit = replace(fit, found=adjust(fit.views, fit.found.state, free))
    for _ in range(OUTLIER_ROUNDS):
        errors_px = fit.position_rms_px()
        bad = outliers(errors_px, max(width for width, _ in fit.sizes))
        if not bad:
            break
        median = float(np.median(errors_px))
        left_out += [
            LeftOut(
                "",
                fit.keys[k],
                f"the cameras disagree by {errors_px[k]:.1f} px, else by {median:.2f}: "
                "did it move?",
            )
            for k in bad
        ]
        good = [k for k in range(len(fit.keys)) if k not in bad]
        views, state = subset(fit.views, fit.found.state, good)
        keys = [fit.keys[k] for k in good]
        fit = replace(fit, keys=keys, views=views, found=adjust(views, state, free))
    return fit, left_out


def _refit(fit: RigFit, model: LensModel) -> RigFit:
    """The fit with another model, from the rig there is; what the model lacks is zero."""
    state = fit.found.state
    start = replace(state, lenses=model.reduced(state.lenses))
    return replace(fit, found=adjust(fit.views, start, _free_unknowns(fit, model)))


def _held_out_squares(fit: RigFit, board: Board, model: LensModel) -> float:
    """RMS over all positions, each with the calibration from the folds it is not in."""
    start = _refit(fit, model).found.state
    free = _free_unknowns(fit, model)
    squares = []
    for held_out in folds(len(fit.keys)):
        state = adjust_without(fit.views, start, held_out, free)
        for k in held_out:
            error = held_out_fit_squares(views_of_board(fit.views, k), state, board)
            if error is not None:
                squares.append(error**2)
    return float(np.sqrt(np.mean(squares))) if squares else float("inf")


def _position_errors(fit: RigFit, board: Board, free: FreeUnknowns) -> list[PositionError]:
    errors_px = fit.position_rms_px()
    without = leave_one_out(fit.views, fit.found, free)
    suspect = suspects(errors_px, [each.influence_percent for each in without])
    return [
        PositionError(
            key=key,
            rms_px=errors_px[k],
            held_out=held_out_error(views_of_board(fit.views, k), without[k].state, board),
            influence_percent=without[k].influence_percent,
            suspect=suspect[k],
        )
        for k, key in enumerate(fit.keys)
    ]
