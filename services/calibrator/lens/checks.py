"""What a lens calibration must fulfil, and the sentence a person reads where it does not. Pure."""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from services.calibrator.board.coverage import Coverage, coverage
from services.calibrator.bundle.adjust import Adjusted
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, rays
from services.calibrator.bundle.views import LeftOut

# Zhang (2000) needs three views in theory; with three, none can be held out.
MIN_VIEWS = 4
# A picture is left out if its corners are this many times as far off as the median picture's, and
# further than _OFF_PX at 640 px width.
_OFF_TIMES, _OFF_PX = 4.0, 0.6
# More pictures than this share are never left out: then the median is not to be trusted either.
_OFF_SHARE = 0.34
# One sigma of the focal length: 1 % of it is 1 % of every distance. The real pairs reach .08 %, a
# board never tilted 5 % and more.
_FOCAL_REFUSED, _FOCAL_WARNED = 0.02, 0.004
# RMS of the fit, px at 640 px width. The real pairs reach .17; blurred and moving boards stay below
# 1.
_RMS_REFUSED = 3.0
# Focal lengths in picture widths of lenses that this model describes: fields of view of 130 to 3
# degrees.
_FOCALS = (0.23, 20.0)
# Boards this parallel leave focal length and distance inseparable. The real pairs span 60 degrees.
_PARALLEL_DEG = 10.0
# Share of the image cells with corners. The real pairs fill .7; below a fifth all views are in one
# place.
_COVERED_REFUSED, _COVERED_WARNED = 0.2, 0.6
# Held-out error on the board in squares. The real pairs reach .005; a wrong count of corners or a
# bent board gives more than .1.
_SQUARES_REFUSED, _SQUARES_WARNED = 0.1, 0.03

_HOW_TO = (
    "Show the board near the camera so that it fills a third of the picture or more, in the middle, in every corner and at every edge, "
    "tilted 20 to 45 degrees to the left, right, up and down"
)


def check_views(camera: str, count: int, left_out: list[LeftOut] | None = None) -> None:
    """Raise CalibrationError if that is too few pictures of a camera."""
    if count >= MIN_VIEWS:
        return
    reason = f"camera {camera!r}: only {count} usable pictures of the board, at least {MIN_VIEWS} are needed (12 to 20 are good)"
    if left_out:
        reason += "; left out: " + "; ".join(f"{item.key} ({item.reason})" for item in left_out[:6])
    raise CalibrationError(f"{reason}. {_HOW_TO}")


def contradicting(errors: list[float], width_px: int) -> list[int]:
    """Positions of errors (px) far above the median; none if there are too many of them."""
    limit = max(_OFF_TIMES * float(np.median(errors)), _OFF_PX * width_px / 640.0)
    bad = [k for k, error in enumerate(errors) if not error <= limit]
    return bad if len(bad) <= _OFF_SHARE * len(errors) else []


def check_fit(camera: str, size_px: tuple[int, int], fit: Adjusted, corners: list[Array]) -> None:
    """Raise CalibrationError, with the reason, if a lens fitted to these corners (n, 2) by view
    must not be used.
    """
    if not fit.rms_px <= _RMS_REFUSED * size_px[0] / 640.0:
        raise CalibrationError(
            f"camera {camera!r}: no lens explains the pictures; their corners are {fit.rms_px:.1f} px off (.2 is good). Is "
            "--board its number of inner corners, is the board flat, are all pictures of the same camera, lens and focus?"
        )
    seen = coverage(size_px, corners, list(fit.state.T_rig_from_board))
    check_lens(camera, size_px, fit.state.lenses[0], fit.lens_sigma[0], 0.0, seen)


def check_lens(
    camera: str,
    size_px: tuple[int, int],
    lens: Array,
    sigma: Array,
    held_out_squares: float,
    seen: Coverage,
) -> tuple[str, ...]:
    """Warnings about a lens (9,) with sigmas (9,).

    Raises CalibrationError, with the reason, if it must not be used.
    """
    focal = float(max(sigma[FX] / abs(lens[FX]), sigma[FY] / abs(lens[FY])))
    _refuse_fit(camera, held_out_squares)
    _refuse_geometry(camera, size_px, lens, focal, seen)
    warnings = []
    if focal > _FOCAL_WARNED:
        warnings.append(
            f"the focal length is known to {100 * focal:.1f} % only; add pictures with the board tilted more"
        )
    if seen.share < _COVERED_WARNED or seen.missing:
        where = f" (missing: {seen.missing})" if seen.missing else ""
        warnings.append(
            f"corners cover {100 * seen.share:.0f} % of the image{where}; lens errors are larger where they are missing"
        )
    if held_out_squares > _SQUARES_WARNED:
        warnings.append(
            f"held-out corners are {held_out_squares:.3f} squares off; is the board flat, and were the pictures sharp?"
        )
    border = _border(size_px)
    if not np.all(np.isfinite(rays(lens, border))):
        warnings.append(
            "the distortion cannot be undone at the edge of the image: pixels there are not measured; add pictures that reach it"
        )
    return tuple(warnings)


def _refuse_fit(camera: str, held_out_squares: float) -> None:
    if held_out_squares > _SQUARES_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: no lens explains the pictures; corners left out of the fit are {held_out_squares:.2f} squares off "
            f"(.01 is good, {_SQUARES_REFUSED:g} the limit). Is the board flat and rigid, are all pictures of the same camera, lens and "
            "focus, is --board its number of inner corners? A fisheye lens of more than about 120 degrees cannot be described by this model"
        )


def _refuse_geometry(
    camera: str, size_px: tuple[int, int], lens: Array, focal: float, seen: Coverage
) -> None:
    inside = 0 <= lens[CX] < size_px[0] and 0 <= lens[CY] < size_px[1]
    if not (
        inside and all(_FOCALS[0] <= lens[name] / size_px[0] <= _FOCALS[1] for name in (FX, FY))
    ):
        raise CalibrationError(
            f"camera {camera!r}: the pictures do not determine the lens: the best fit has its centre at {lens[CX]:.0f}, {lens[CY]:.0f} px "
            f"and a focal length of {lens[FX]:.0f} px, which no camera has. Was the board never tilted? {_HOW_TO}"
        )
    span = f"its normals are at most {seen.normals_deg:.0f} degrees apart, its tilts {min(seen.tilt_deg):.0f} to {max(seen.tilt_deg):.0f}"
    if seen.normals_deg < _PARALLEL_DEG:
        raise CalibrationError(
            f"camera {camera!r}: the board was always held at about the same angle ({span}), so focal length and distance cannot "
            f"be told apart. {_HOW_TO}"
        )
    if not np.isfinite(focal) or focal > _FOCAL_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: the pictures leave the focal length uncertain by {100 * focal:.1f} % (at most {100 * _FOCAL_REFUSED:g} %; "
            f"board: {span}; corners cover {100 * seen.share:.0f} % of the image). {_HOW_TO}"
        )
    if seen.share < _COVERED_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: corners cover {100 * seen.share:.0f} % of the image (at least {100 * _COVERED_REFUSED:.0f} % are needed; "
            f"missing: {seen.missing or 'all over'}). {_HOW_TO}"
        )


def _border(size_px: tuple[int, int]) -> Array:
    """Pixels around the edge of the picture; (n, 2)."""
    width, height = size_px
    x, y = np.linspace(0.0, width - 1.0, 33), np.linspace(0.0, height - 1.0, 25)
    return np.concatenate(
        [np.stack([x, np.full_like(x, edge)], axis=1) for edge in (0.0, height - 1.0)]
        + [np.stack([np.full_like(y, edge), y], axis=1) for edge in (0.0, width - 1.0)]
    )
