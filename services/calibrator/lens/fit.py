"""Fitting a lens to pictures of a board: adjustment in stages, outlier pictures left out. Pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut, board_view, same_size
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.adjust import Adjustment, FreeUnknowns, adjust
from services.calibrator.bundle.initial_guess import guess_board_pose, guess_lens
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, K1, K2, P1, P2
from services.calibrator.bundle.outliers import OUTLIER_ROUNDS, outliers
from services.calibrator.bundle.residuals import State, View, rms
from services.calibrator.lens.checks import check_count
from services.calibrator.lens.model_selection import USUAL_MODEL, only_free
from services.calibrator.lens.result import LensFit

# What is free stage by stage, before all is: distortion must not explain a focal length that is far
# off.
_STAGES = (
    only_free(FX, FY),
    only_free(FX, FY, K1),
    only_free(FX, FY, CX, CY, K1, K2),
    only_free(FX, FY, CX, CY, K1, K2, P1, P2),
)


def fit_pictures(
    camera: str, detections: dict[str, Detection], board: Board
) -> tuple[LensFit, list[LeftOut]]:
    """The usual lens model fitted to the pictures that agree, and the pictures left out.

    Raises CalibrationError if too few are left.
    """
    size_px, kept, left_out = same_size(camera, detections)
    keys = list(kept)
    check_count(camera, len(keys))
    views = [board_view(board, kept[key], 0, number) for number, key in enumerate(keys)]
    outlier_pictures: list[LeftOut] = []
    found = fit_lens(size_px, views, USUAL_MODEL.free)
    for _ in range(OUTLIER_ROUNDS):
        errors_px = [rms(residual) for residual in found.residuals]
        bad = outliers(errors_px, size_px[0])
        if not bad:
            break
        median = np.median(errors_px)
        outlier_pictures += [
            LeftOut(
                camera,
                keys[k],
                f"its corners are {errors_px[k]:.1f} px off, the others' {median:.2f}",
            )
            for k in bad
        ]
        good = [k for k in range(len(keys)) if k not in bad]
        check_count(camera, len(good), outlier_pictures)
        keys = [keys[k] for k in good]
        views = [replace(views[k], board=number) for number, k in enumerate(good)]
        found = fit_lens(size_px, views, USUAL_MODEL.free)
    return LensFit(camera, size_px, keys, views, found), [*left_out, *outlier_pictures]


def fit_lens(size_px: tuple[int, int], views: list[View], free: np.ndarray) -> Adjustment:
    """One camera's lens and the poses of its boards, from nothing but its views.

    The boards are numbered 0..n-1. free (9,) bool says which numbers of the lens may move; the
    others are those of an ideal lens.
    """
    found = fit_poses(guess_lens(size_px, views), views, _STAGES[0] & free)
    # Last all again: a pose of the wrong branch (a near-frontal board turned around) is found
    # with the lens then known. And a stage that ends in a worse minimum than the one before, as k3
    # does with boards that were never tilted, is forgotten.
    for stage in (*_STAGES[1:], np.ones_like(free), np.ones_like(free)):
        again = fit_poses(found.state.lenses[0], views, stage & free)
        found = again if again.rms_px <= found.rms_px else found
    return found


def fit_poses(lens: Array, views: list[View], free: np.ndarray) -> Adjustment:
    """Adjust a lens (9,) where it is free (9,) bool, and the board poses that it suggests."""
    poses = np.stack([guess_board_pose(lens, view)[0] for view in views])
    start = State(lens[None].copy(), np.eye(4)[None], poses)
    return adjust(views, start, FreeUnknowns.one_lens(free))
