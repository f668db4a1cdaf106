"""`rhot calibrate lens`: one camera's lens from pictures of a board, with the error it has on
pictures it was not made from. Pure.

Pictures that contradict the others are left out and named. What cannot be calibrated - too few
pictures, a board never tilted, one corner of the image only - is refused with a CalibrationError
that says what is wrong and what to do: a lens that fits its pictures and is wrong elsewhere would
be worse than none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.adjust import Adjusted, Free, adjust
from services.calibrator.bundle.initial_guess import calibrate_lens, with_poses
from services.calibrator.bundle.lens_model import rays
from services.calibrator.bundle.residuals import State, View, board_rms, rms
from services.calibrator.bundle.views import (
    LeftOut,
    alone,
    hurting,
    others,
    pull_percent,
    same_size,
    subset,
    view_of,
)
from services.calibrator.lens.checks import check_fit, check_lens, check_views, contradicting
from services.calibrator.lens.model_selection import USUAL, LensModel, choose, folds

# Rounds of leaving out pictures; each round may show others that the worst ones hid.
_ROUNDS = 4


@dataclass(frozen=True)
class PictureError:
    """One picture: error of its corners in the calibration, and in the calibration from all other
    pictures.

    pull_percent is by how much this picture raises the error of all others, on average; hurts marks
    pictures to look at.
    """

    key: str
    rms_px: float
    held_out_px: float
    held_out_squares: float
    pull_percent: float
    hurts: bool = False


@dataclass(frozen=True, eq=False)
class LensResult:
    """A camera's lens (9,) with sigmas (9,), and what is known of its quality."""

    camera: str
    size_px: tuple[int, int]
    lens: Array
    sigma: Array
    model: str
    rms_px: float
    held_out_px: float
    held_out_squares: float
    coverage: Coverage
    pictures: tuple[PictureError, ...]
    left_out: tuple[LeftOut, ...]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Fit:
    """A lens adjusted to views whose boards are numbered 0..n-1; keys are the pictures' names."""

    keys: list[str]
    views: list[View]
    found: Adjusted


def calibrate_camera(camera: str, detections: dict[str, Detection], board: Board) -> LensResult:
    """Calibrate a camera's lens from the boards found in its pictures (key -> detection).

    Raises CalibrationError, with the reason, if the pictures cannot support a calibration.
    """
    size_px, kept, left_out = same_size(camera, detections)
    fit, contrary = fit_lens(camera, size_px, kept, board)
    check_fit(camera, size_px, fit.found, [view.pixels for view in fit.views])
    model, _ = choose(lambda model: _held_out_rms(fit, model))
    fit = Fit(fit.keys, fit.views, _refit(fit, model))
    pictures = _picture_errors(fit, model, board)
    seen = coverage(
        size_px, [view.pixels for view in fit.views], list(fit.found.state.T_rig_from_board)
    )
    result = LensResult(
        camera,
        size_px,
        fit.found.state.lenses[0],
        fit.found.lens_sigma[0],
        model.name,
        fit.found.rms_px,
        _mean_square([picture.held_out_px for picture in pictures]),
        _mean_square([picture.held_out_squares for picture in pictures]),
        seen,
        tuple(pictures),
        (*left_out, *contrary),
    )
    return replace(
        result,
        warnings=check_lens(
            camera, size_px, result.lens, result.sigma, result.held_out_squares, seen
        ),
    )


def fit_lens(
    camera: str, size_px: tuple[int, int], detections: dict[str, Detection], board: Board
) -> tuple[Fit, list[LeftOut]]:
    """The usual lens model fitted to the pictures that agree with each other, and those that do
    not.

    Raises CalibrationError if too few are left.
    """
    keys = list(detections)
    check_views(camera, len(keys))
    views = [view_of(board, detections[key], 0, number) for number, key in enumerate(keys)]
    found = calibrate_lens(size_px, views, USUAL.free)
    left_out: list[LeftOut] = []
    for _ in range(_ROUNDS):
        errors = [rms(error) for error in found.errors]
        bad = contradicting(errors, size_px[0])
        if not bad:
            break
        left_out += [
            LeftOut(
                camera,
                keys[k],
                f"its corners are {errors[k]:.1f} px off, the others' {np.median(errors):.2f}",
            )
            for k in bad
        ]
        keep = [k for k in range(len(keys)) if k not in bad]
        check_views(camera, len(keep), left_out)
        keys, views = (
            [keys[k] for k in keep],
            [replace(views[k], board=number) for number, k in enumerate(keep)],
        )
        found = calibrate_lens(size_px, views, USUAL.free)
    return Fit(keys, views, found), left_out


def _refit(fit: Fit, model: LensModel) -> Adjusted:
    """The fit with another model, beginning with the lens there is.

    Numbers the model lacks are zero.
    """
    lens = np.where(model.free, fit.found.state.lenses[0], 0.0)
    return adjust(
        fit.views,
        replace(fit.found.state, lenses=lens[None]),
        Free(model.free[None], np.array([False])),
    )


def _held_out_rms(fit: Fit, model: LensModel) -> float:
    """RMS px over all pictures, each with the lens from the parts it is not in."""
    state = _refit(fit, model).state
    squares = []
    for part in folds(len(fit.views)):
        lens = _lens_without(fit.views, state, part, model)
        squares += [rms(_pose_errors(lens, fit.views[k])) ** 2 for k in part]
    return float(np.sqrt(np.mean(squares)))


def _lens_without(views: list[View], state: State, part: np.ndarray, model: LensModel) -> Array:
    rest, start = subset(views, state, others(len(views), part))
    return adjust(rest, start, Free(model.free[None], np.array([False]))).state.lenses[0]


def _pose_errors(lens: Array, view: View) -> Array:
    """Errors (n, 2) px of one view with this lens and the pose that suits it best."""
    return with_poses(lens, [alone(view)], np.zeros(9, dtype=bool)).errors[0]


def _picture_errors(fit: Fit, model: LensModel, board: Board) -> list[PictureError]:
    state = fit.found.state
    errors = board_rms(fit.views, fit.found.errors, len(fit.keys))
    pictures = []
    for k, (key, view) in enumerate(zip(fit.keys, fit.views, strict=True)):
        rest, start = subset(fit.views, state, others(len(fit.views), np.array([k])))
        without = adjust(rest, start, Free(model.free[None], np.array([False])))
        pull = pull_percent(
            errors[:k] + errors[k + 1 :], board_rms(rest, without.errors, len(rest))
        )
        lens = without.state.lenses[0]
        pictures.append(
            PictureError(
                key,
                errors[k],
                rms(_pose_errors(lens, view)),
                _on_board(lens, view) / board.square_m,
                pull,
            )
        )
    bad = hurting(errors, [picture.pull_percent for picture in pictures])
    return [replace(picture, hurts=hurts) for picture, hurts in zip(pictures, bad, strict=True)]


def _on_board(lens: Array, view: View) -> float:
    """RMS distance in metres, on the board's plane, between its corners and where the pixels' rays
    meet the plane.
    """
    T = with_poses(lens, [alone(view)], np.zeros(9, dtype=bool)).state.T_rig_from_board[0]
    seen = rays(lens, view.pixels)
    directions = np.concatenate([seen, np.ones((len(seen), 1))], axis=1) @ T[:3, :3]
    origin = -T[:3, 3] @ T[:3, :3]
    points = origin - directions * (origin[2] / directions[:, 2])[:, None]
    return rms(points - view.points)


def _mean_square(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else 0.0
