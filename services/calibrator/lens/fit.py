"""Fitting a lens to views of a board: adjustment in stages. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.adjust import Adjustment, FreeUnknowns, adjust
from services.calibrator.bundle.initial_guess import guess_board_pose, guess_lens
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, K1, K2, P1, P2
from services.calibrator.bundle.residuals import State, View
from services.calibrator.lens.model_selection import only_free

# What is free stage by stage, before all is: distortion must not explain a focal length that is far
# off.
_STAGES = (
    only_free(FX, FY),
    only_free(FX, FY, K1),
    only_free(FX, FY, CX, CY, K1, K2),
    only_free(FX, FY, CX, CY, K1, K2, P1, P2),
)


def fit_lens(
    size_px: tuple[int, int], views: list[View], free: np.ndarray, *, fisheye: bool = False
) -> Adjustment:
    """One camera's lens and the poses of its boards, from nothing but its views.

    The boards are numbered 0..n-1. free (9,) bool says which numbers of the lens may move; the
    others are those of an ideal lens.
    """
    found = fit_poses(guess_lens(size_px, views, fisheye=fisheye), views, _STAGES[0] & free)
    # Last all again: a pose of the wrong branch (a near-frontal board turned the other way) is
    # found with the lens then known. And a stage that ends in a worse minimum than the one before,
    # as k3 does with boards that were never tilted, is forgotten.
    for stage in (*_STAGES[1:], np.ones_like(free), np.ones_like(free)):
        again = fit_poses(found.state.lenses[0], views, stage & free)
        found = again if again.rms_px <= found.rms_px else found
    return found


def fit_poses(lens: Array, views: list[View], free: np.ndarray) -> Adjustment:
    """Adjust a lens (9,) where it is free (9,) bool, and the board poses that it suggests."""
    poses = np.stack([guess_board_pose(lens, view)[0] for view in views])
    start = State(lens[None].copy(), np.eye(4)[None], poses)
    return adjust(views, start, FreeUnknowns.one_lens(free))
