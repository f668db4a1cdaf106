"""`rhot calibrate stereo`: lenses and places of 2..N cameras from one board they saw together.
Pure.

First each camera's lens from its own pictures, then pairs of cameras, then one adjustment of
everything. Every position of the board is left out once, and the calibration from the others
triangulates it: the report's figures are those held-out errors. Pictures that contradict the others
are left out and named. Data that cannot support a calibration are refused with a CalibrationError
that says why.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.board.detect import Detection
from services.calibrator.board.picture_folder import natural
from services.calibrator.bundle.adjust import Adjusted, Free, adjust
from services.calibrator.bundle.initial_guess import board_pose
from services.calibrator.bundle.residuals import State, View, board_rms, pixel_errors, rms
from services.calibrator.bundle.views import (
    LeftOut,
    hurting,
    others,
    pull_percent,
    same_size,
    subset,
    view_of,
)
from services.calibrator.lens.calibrate import fit_lens
from services.calibrator.lens.checks import check_fit, contradicting
from services.calibrator.lens.model_selection import USUAL, LensModel, choose, folds
from services.calibrator.rig.checks import check_rig, check_shared
from services.calibrator.rig.held_out_error import BoardError, board_error, fit_squares
from services.calibrator.rig.relative_pose import place_cameras

_ROUNDS = 4
Progress = Callable[[str], None]


@dataclass(frozen=True)
class PositionError:
    """One position of the board: RMS px of its corners in the calibration, its error held out, and
    how much it hurts the others.

    held_out is None where no two cameras see it. pull_percent is by how much this position raises
    the error of all others; hurts marks positions to look at.
    """

    key: str
    rms_px: float
    held_out: BoardError | None
    pull_percent: float
    hurts: bool = False


@dataclass(frozen=True, eq=False)
class RigResult:
    """The calibrated rig: cameras, sizes (w, h), lenses (c, 9) and T_camera_from_rig (c, 4, 4) with
    sigmas, and its errors.

    rms_px is over all corners of all cameras. held_out_squares is the RMS over all corners of all
    held-out boards, triangulated; held_out_px their RMS in the pictures; square_ratio the mean side
    of their squares over the true one, square_worst the position farthest from 1.
    """

    board: Board
    cameras: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...]
    state: State
    lens_sigma: Array
    place_sigma: Array
    lenses_given: bool
    model: str
    rms_px: float
    camera_rms_px: tuple[float, ...]
    held_out_squares: float
    held_out_px: float
    square_ratio: float
    square_worst: float
    epipolar_px: float
    coverage: tuple[Coverage, ...]
    positions: tuple[PositionError, ...]
    left_out: tuple[LeftOut, ...]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Rig:
    """The adjustment under way: views whose boards are numbered as keys."""

    names: list[str]
    sizes: list[tuple[int, int]]
    keys: list[str]
    views: list[View]
    found: Adjusted


def calibrate_rig(
    detections: dict[str, dict[str, Detection]],
    board: Board,
    lenses: dict[str, Array] | None = None,
    say: Progress = lambda _: None,
) -> RigResult:
    """Calibrate a rig from the boards found in each camera's pictures (camera -> key -> detection);
    equal keys are one instant.

    lenses (camera -> (9,)) are taken as they are if given, else found as well. The first camera is
    the rig frame.

    Raises CalibrationError, with the reason, if the pictures cannot support a calibration.
    """
    check_shared(detections)
    say("lenses")
    rig, left_out = _start(detections, board, lenses)
    say("places")
    rig, contrary = _settle(rig, _free(rig, USUAL, lenses))
    model = USUAL
    if lenses is None:
        say("choosing the lens model")
        model, _ = choose(lambda model: _held_out_squares(rig, board, model))
        rig = replace(rig, found=_refit(rig, model))
    say("held-out errors")
    positions = _positions(rig, board, _free(rig, model, lenses))
    result = _result(rig, board, model, positions, (*left_out, *contrary), lenses is not None)
    return replace(result, warnings=check_rig(result))


def _start(
    detections: dict[str, dict[str, Detection]], board: Board, lenses: dict[str, Array] | None
) -> tuple[Rig, list[LeftOut]]:
    """Every lens by itself, then the cameras' places by pairs."""
    names = list(detections)
    sizes, left_out, good, found = [], [], [], []
    for name in names:
        size_px, kept, strange = same_size(name, detections[name])
        left_out += strange
        if lenses is None:
            fit, contrary = fit_lens(name, size_px, kept, board)
            left_out += contrary
            kept = {key: kept[key] for key in fit.keys}
            found.append(fit.found.state.lenses[0])
            check_fit(name, size_px, fit.found, [view.pixels for view in fit.views])
        else:
            found.append(lenses[name])
        sizes.append(size_px)
        good.append(kept)
    keys = [key for key in _ordered(detections) if any(key in kept for kept in good)]
    number = {key: k for k, key in enumerate(keys)}
    views = [
        view_of(board, shown, camera, number[key])
        for camera, kept in enumerate(good)
        for key, shown in kept.items()
    ]
    all_lenses = np.stack(found)
    places, views = place_cameras(names, sizes, all_lenses, views, board)
    poses = np.stack([_pose(k, views, all_lenses, places) for k in range(len(keys))])
    state = State(all_lenses, places, poses)
    return Rig(
        names,
        sizes,
        keys,
        views,
        Adjusted(state, (), np.zeros_like(all_lenses), np.zeros((len(names), 6)), 0),
    ), left_out


def _ordered(detections: dict[str, dict[str, Detection]]) -> list[str]:
    """All keys, each once, 2 before 10."""
    return sorted({key for found in detections.values() for key in found}, key=natural)


def _pose(number: int, views: list[View], lenses: Array, places: Array) -> Array:
    """T_rig_from_board by the view whose pose fits all views of the position best."""
    mine = [view for view in views if view.board == number]
    best, least = np.eye(4), float("inf")
    for view in mine:
        T = np.linalg.inv(places[view.camera]) @ board_pose(lenses[view.camera], view)[0]
        state = State(lenses, places, T[None])
        error = sum(rms(miss) for miss in _errors(mine, state))
        if error < least:
            best, least = T, error
    return best


def _errors(views: list[View], state: State) -> list[Array]:
    return [
        np.nan_to_num(error, nan=1e6)
        for error in pixel_errors([replace(view, board=0) for view in views], state)
    ]


def _free(rig: Rig, model: LensModel, lenses: dict[str, Array] | None) -> Free:
    cameras = len(rig.names)
    lens = (
        np.zeros((cameras, 9), dtype=bool)
        if lenses is not None
        else np.tile(model.free, (cameras, 1))
    )
    return Free(lens, np.arange(cameras) > 0)


def _settle(rig: Rig, free: Free) -> tuple[Rig, list[LeftOut]]:
    """Adjust everything, and leave out positions that contradict the others."""
    left_out: list[LeftOut] = []
    for _ in range(_ROUNDS):
        found = adjust(rig.views, rig.found.state, free)
        rig = replace(rig, found=found)
        errors = position_rms(rig)
        bad = contradicting(errors, max(width for width, _ in rig.sizes))
        if not bad:
            break
        median = float(np.median(errors))
        left_out += [
            LeftOut(
                "",
                rig.keys[k],
                f"the cameras disagree by {errors[k]:.1f} px, else by {median:.2f}: did it move?",
            )
            for k in bad
        ]
        keep = [k for k in range(len(rig.keys)) if k not in bad]
        views, state = subset(rig.views, found.state, keep)
        rig = replace(
            rig, keys=[rig.keys[k] for k in keep], views=views, found=replace(found, state=state)
        )
    return rig, left_out


def position_rms(rig: Rig) -> list[float]:
    """RMS px of every position of the board."""
    return board_rms(rig.views, rig.found.errors, len(rig.keys))


def _refit(rig: Rig, model: LensModel) -> Adjusted:
    lenses = np.where(model.free, rig.found.state.lenses, 0.0)
    return adjust(rig.views, replace(rig.found.state, lenses=lenses), _free(rig, model, None))


def _held_out_squares(rig: Rig, board: Board, model: LensModel) -> float:
    """RMS over all positions, each with the calibration from the parts it is not in."""
    found = _refit(rig, model)
    squares = []
    for part in folds(len(rig.keys)):
        rest, start = subset(rig.views, found.state, others(len(rig.keys), part))
        state = adjust(rest, start, _free(rig, model, None)).state
        errors = [
            fit_squares([view for view in rig.views if view.board == k], state, board) for k in part
        ]
        squares += [error**2 for error in errors if error is not None]
    return float(np.sqrt(np.mean(squares))) if squares else float("inf")


def _positions(rig: Rig, board: Board, free: Free) -> list[PositionError]:
    errors = position_rms(rig)
    result = []
    for k, key in enumerate(rig.keys):
        rest, start = subset(rig.views, rig.found.state, others(len(rig.keys), np.array([k])))
        without = adjust(rest, start, free)
        pull = pull_percent(
            errors[:k] + errors[k + 1 :], board_rms(rest, without.errors, len(rig.keys) - 1)
        )
        mine = [view for view in rig.views if view.board == k]
        result.append(PositionError(key, errors[k], board_error(mine, without.state, board), pull))
    bad = hurting(errors, [position.pull_percent for position in result])
    return [replace(position, hurts=hurts) for position, hurts in zip(result, bad, strict=True)]


def _result(
    rig: Rig,
    board: Board,
    model: LensModel,
    positions: list[PositionError],
    left_out: tuple[LeftOut, ...],
    lenses_given: bool,
) -> RigResult:
    held_out = [position.held_out for position in positions if position.held_out]
    ratios = np.array([error.square_ratio for error in held_out])
    state = rig.found.state
    seen, camera_rms = [], []
    for camera, size_px in enumerate(rig.sizes):
        mine = [
            (view, error)
            for view, error in zip(rig.views, rig.found.errors, strict=True)
            if view.camera == camera
        ]
        poses = [
            state.T_camera_from_rig[camera] @ state.T_rig_from_board[view.board] for view, _ in mine
        ]
        seen.append(coverage(size_px, [view.pixels for view, _ in mine], poses))
        camera_rms.append(rms(np.concatenate([error for _, error in mine])))
    return RigResult(
        board=board,
        cameras=tuple(rig.names),
        sizes=tuple(rig.sizes),
        state=state,
        lens_sigma=rig.found.lens_sigma,
        place_sigma=rig.found.place_sigma,
        lenses_given=lenses_given,
        model="as given" if lenses_given else model.name,
        rms_px=rig.found.rms_px,
        camera_rms_px=tuple(camera_rms),
        held_out_squares=_root_mean([error.fit_squares for error in held_out]),
        held_out_px=_root_mean([error.reprojection_px for error in held_out]),
        square_ratio=float(ratios.mean()) if len(ratios) else float("nan"),
        square_worst=float(ratios[np.argmax(np.abs(ratios - 1.0))])
        if len(ratios)
        else float("nan"),
        epipolar_px=_root_mean([error.epipolar_px for error in held_out]),
        coverage=tuple(seen),
        positions=tuple(positions),
        left_out=left_out,
    )


def _root_mean(values: list[float]) -> float:
    """RMS of values; inf of none."""
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("inf")
