"""Whether pictures are of two lenses: of two cameras, or of one that was refocused. Pure.

Asked where one lens explains the pictures badly. The pictures are dealt to two lenses in turn, as
k-means deals points to two middles: each to the lens that explains it better, then both lenses
anew. Two lenses that explain all pictures well, and much better than one did, are told.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from services.calibrator.bundle.adjust import Adjustment
from services.calibrator.bundle.initial_guess import guess_board_pose
from services.calibrator.bundle.lens_model import FX, FY
from services.calibrator.bundle.residuals import View
from services.calibrator.lens.checks import MIN_VIEWS
from services.calibrator.lens.fit import fit_poses
from services.calibrator.lens.model_selection import USUAL_MODEL

# RMS of one lens, px at 640 px width, beyond which two are tried; and what two must bring it down
# to, as a share. Synthetic cameras of focal lengths 2 % apart reach .9 px together and .17 px as
# two; the real pair, whose lenses differ by .6 %, .21 and .165: it has to be told by its names.
_ASK_PX, _SHARE = 0.35, 0.5
# Focal lengths tried for single pictures, as shares of the common one.
_SHARES = np.geomspace(0.5, 2.0, 29)
_ROUNDS = 4
# Pictures of each lens that are named.
_NAMED = 4


def two_lenses(
    keys: list[str], size_px: tuple[int, int], views: list[View], one: Adjustment
) -> tuple[list[str], list[str]] | None:
    """The pictures of two lenses, or None where one lens (or none) explains them.

    views are numbered 0..n-1 as the keys, and `one` is the lens fitted to all of them.
    """
    if len(views) < 2 * MIN_VIEWS or one.rms_px <= _ASK_PX * size_px[0] / 640.0:
        return None
    for dealt in _starts(views, one.state.lenses[0]):
        found = _dealt_again(views, dealt, one.state.lenses[0])
        if found is not None and found[1] <= _SHARE * one.rms_px:
            first = [key for key, second in zip(keys, found[0], strict=True) if not second]
            return first, [key for key in keys if key not in first]
    return None


def check_one_lens(
    camera: str, keys: list[str], size_px: tuple[int, int], views: list[View], one: Adjustment
) -> None:
    """Raise CalibrationError, with both groups of pictures, if they are of two lenses."""
    groups = two_lenses(keys, size_px, views, one)
    if groups is None:
        return
    named = " and ".join(f"{len(group)} of one ({_few(group)})" for group in groups)
    raise CalibrationError(
        f"camera {camera!r}: the pictures are of two lenses: {named}; one lens leaves "
        f"{one.rms_px:.1f} px. Are they of two cameras, or was the focus, the zoom or the mode of "
        "the camera changed in between? Put the pictures of one lens into a folder of their own"
    )


def _few(keys: list[str]) -> str:
    return ", ".join(keys[:_NAMED]) + (", ..." if len(keys) > _NAMED else "")


def _starts(views: list[View], lens: Array) -> list[np.ndarray]:
    """Which pictures (n,) bool may be the second lens's: by focal length, by order, alternating."""
    focals = np.array([_best_share(view, lens) for view in views])
    count = np.arange(len(views))
    return [focals > np.median(focals), count >= len(views) / 2, count % 2 == 1]


def _best_share(view: View, lens: Array) -> float:
    """The share of the common focal length with which one picture fits best."""
    errors = [_error_px(_scaled(lens, share), view) for share in _SHARES]
    return float(_SHARES[int(np.argmin(errors))])


def _scaled(lens: Array, share: float) -> Array:
    scaled = lens.copy()
    scaled[[FX, FY]] *= share
    return scaled


def _dealt_again(
    views: list[View], dealt: np.ndarray, start: Array
) -> tuple[np.ndarray, float] | None:
    """The pictures (n,) bool of the second of two lenses, and the RMS px of all; None if one lens
    is left with too few.
    """
    lenses = [start, start]
    error = float("inf")
    for _ in range(_ROUNDS):
        if min(np.count_nonzero(dealt), np.count_nonzero(~dealt)) < MIN_VIEWS:
            return None
        fits = [
            _fitted(lens, [view for view, mine in zip(views, dealt == second, strict=True) if mine])
            for second, lens in enumerate(lenses)
        ]
        lenses = [fit.state.lenses[0] for fit in fits]
        error = max(fit.rms_px for fit in fits)
        again = np.array([np.argmin([_error_px(lens, v) for lens in lenses]) for v in views]) == 1
        if np.array_equal(again, dealt):
            break
        dealt = again
    return dealt, error


def _fitted(lens: Array, views: list[View]) -> Adjustment:
    """The lens of these views, from the lens there is at the focal length that suits them."""
    share = float(np.median([_best_share(view, lens) for view in views]))
    own = [replace(view, board=n) for n, view in enumerate(views)]
    return fit_poses(_scaled(lens, share), own, USUAL_MODEL.free_of(lens))


def _error_px(lens: Array, view: View) -> float:
    """About how many px (RMS) one picture is off with a lens that is held."""
    return guess_board_pose(lens, view)[1]
