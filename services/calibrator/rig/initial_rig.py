"""A rig to begin the adjustment with: lenses one by one, cameras by pairs, boards by view. Pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.files.calibration import LensKind
from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut, board_view, same_size
from services.calibrator.board.detect import Detection, Detections
from services.calibrator.board.picture_names import natural_key
from services.calibrator.bundle.adjust import Adjustment
from services.calibrator.bundle.initial_guess import guess_board_pose
from services.calibrator.bundle.residuals import POSE_SIZE, State, View, rms, view_residuals
from services.calibrator.bundle.views import views_of_board
from services.calibrator.lens.checks import check_fit
from services.calibrator.lens.screening import fit_pictures
from services.calibrator.rig.extrinsics import Cameras, find_extrinsics
from services.calibrator.rig.result import RigFit

# Counts for the residual of a corner behind its camera, px.
_BEHIND_PX = 1e6


def initial_rig(
    detections: Detections,
    board: Board,
    lenses: dict[str, Array] | None,
    kind: LensKind | None = None,
) -> tuple[RigFit, list[LeftOut]]:
    """The rig before it is adjusted as a whole, and the pictures left out.

    lenses (camera -> (9,)) are found if they are not given, of that kind or the better one of each
    camera. Raises CalibrationError if the pictures
    support no lens, or a camera's pose cannot be found.
    """
    left_out: list[LeftOut] = []
    sizes, usable, found = [], [], []
    for name in detections:
        if lenses is None:
            size_px, kept, lens, others = _own_lens(name, detections[name], board, kind)
        else:
            size_px, kept, others = same_size(name, detections[name])
            lens = lenses[name]
        sizes.append(size_px)
        usable.append(kept)
        found.append(lens)
        left_out += others
    cameras = Cameras(list(detections), sizes, np.stack(found))
    keys = [key for key in _ordered_keys(detections) if any(key in kept for kept in usable)]
    number = {key: k for k, key in enumerate(keys)}
    views = [
        board_view(board, detection, camera, number[key])
        for camera, kept in enumerate(usable)
        for key, detection in kept.items()
    ]
    T_camera_from_rig, views = find_extrinsics(cameras, views, board)
    held = State(cameras.lenses, T_camera_from_rig, np.zeros((0, 4, 4)))
    poses = np.stack([_board_pose(views_of_board(views, k), held) for k in range(len(keys))])
    start = Adjustment(
        state=replace(held, T_rig_from_board=poses),
        residuals=(),
        lens_sigma=np.zeros_like(cameras.lenses),
        extrinsics_sigma=np.zeros((len(cameras.names), POSE_SIZE)),
    )
    return RigFit(cameras.names, sizes, keys, views, start), left_out


def _own_lens(
    name: str, detections: dict[str, Detection], board: Board, kind: LensKind | None
) -> tuple[tuple[int, int], dict[str, Detection], Array, list[LeftOut]]:
    """A camera's picture size, usable detections and lens, from its own pictures alone."""
    fit, left_out = fit_pictures(name, detections, board, kind)
    check_fit(fit)
    usable = {key: detections[key] for key in fit.keys}
    return fit.size_px, usable, fit.found.state.lenses[0], left_out


def _ordered_keys(detections: Detections) -> list[str]:
    """All keys, each once, 2 before 10."""
    return sorted({key for found in detections.values() for key in found}, key=natural_key)


def _board_pose(views: list[View], held: State) -> Array:
    """T_rig_from_board by that one of a board's views whose pose fits all of them best."""
    alone = [replace(view, board=0) for view in views]
    best, least = np.eye(4), float("inf")
    for view in alone:
        T_camera_from_board = guess_board_pose(held.lenses[view.camera], view)[0]
        T = np.linalg.inv(held.T_camera_from_rig[view.camera]) @ T_camera_from_board
        residuals = view_residuals(alone, replace(held, T_rig_from_board=T[None]))
        error = sum(rms(np.nan_to_num(residual, nan=_BEHIND_PX)) for residual in residuals)
        if error < least:
            best, least = T, error
    return best
