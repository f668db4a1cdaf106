"""What a lens calibration must fulfil, and the sentence a person reads where it does not. Pure."""

from __future__ import annotations

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from services.calibrator.board.board_views import LeftOut
from services.calibrator.board.coverage import Coverage
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, is_fisheye, rays_from_pixels
from services.calibrator.lens.result import LensEstimate, LensFit

# Zhang (2000) needs three views in theory; with three, none can be held out.
MIN_VIEWS = 4
# Pictures left out that an error names.
_NAMED = 6
# One sigma of the focal length: 1 % of it is 1 % of every distance. The real pairs reach .08 %, a
# board never tilted 5 % and more.
_FOCAL_REFUSED, _FOCAL_WARNED = 0.02, 0.004
# RMS of the fit, px at 640 px width. The real pairs reach .17; blurred and moving boards stay below
# 1.
_RMS_REFUSED = 3.0
# Focal lengths in picture widths of lenses that the models describe: fields of view of 130 degrees
# (170 with a fisheye) to 3.
_FOCALS = (0.23, 20.0)
# Boards this parallel leave focal length and distance inseparable. The real pairs span 60 degrees.
_PARALLEL_DEG = 10.0
# Share of the image cells with corners. The real pairs fill .7; below a fifth all views are in one
# place.
_COVERED_REFUSED, _COVERED_WARNED = 0.2, 0.6
# Held-out error on the board in squares. The real pairs reach .005; a wrong count of corners or a
# bent board gives more than .1.
_SQUARES_REFUSED, _SQUARES_WARNED = 0.1, 0.03
# Pixels along each side of the picture where the inverse of the distortion is tried.
_BORDER_X, _BORDER_Y = 33, 25

_HOW_TO = (
    "Show the board near the camera so that it fills a third of the picture or more, in the "
    "middle, in every corner and at every edge, tilted 20 to 45 degrees to the left, right, up and "
    "down"
)


def check_count(camera: str, count: int, left_out: list[LeftOut] | None = None) -> None:
    """Raise CalibrationError if a camera has too few pictures of the board."""
    if count >= MIN_VIEWS:
        return
    reason = (
        f"camera {camera!r}: only {count} usable picture{'' if count == 1 else 's'} of the board, "
        f"at least {MIN_VIEWS} are needed (12 to 20 are good)"
    )
    if not count:
        reason += "; is --board its number of inner corners (one less than the squares each way)?"
    if left_out:
        named = (f"{item.key} ({item.reason})" for item in left_out[:_NAMED])
        reason += "; left out: " + "; ".join(named)
    raise CalibrationError(f"{reason}. {_HOW_TO}")


def check_fit(fit: LensFit) -> None:
    """Raise CalibrationError, with the reason, if the lens of a fit must not be used."""
    if not fit.found.rms_px <= _RMS_REFUSED * fit.size_px[0] / 640.0:
        raise CalibrationError(
            f"camera {fit.camera!r}: no lens explains the pictures; their corners are "
            f"{fit.found.rms_px:.1f} px off (.2 is good). Is --board its number of inner corners, "
            "is the board flat, are all pictures of the same camera, lens and focus?"
        )
    _refuse_geometry(fit.estimate())


def check_lens(estimate: LensEstimate, held_out_squares: float | None = None) -> tuple[str, ...]:
    """Warnings about a lens; its held-out error is checked as well if it is given.

    Raises CalibrationError, with the reason, if the lens must not be used.
    """
    if held_out_squares is not None:
        _refuse_held_out(estimate.camera, held_out_squares)
    _refuse_geometry(estimate)
    covered = estimate.coverage
    focal_share = _focal_share(estimate)
    warnings = []
    if focal_share > _FOCAL_WARNED:
        warnings.append(
            f"the focal length is known to {100 * focal_share:.1f} % only; add pictures with the "
            "board tilted more"
        )
    if covered.share < _COVERED_WARNED or covered.missing:
        where = f" (missing: {covered.missing})" if covered.missing else ""
        warnings.append(
            f"corners cover {100 * covered.share:.0f} % of the image{where}; lens errors are "
            "larger where they are missing; add pictures of the board there"
        )
    if held_out_squares is not None and held_out_squares > _SQUARES_WARNED:
        warnings.append(
            f"held-out corners are {held_out_squares:.3f} squares off; is the board flat, and were "
            "the pictures sharp?"
        )
    if not np.all(np.isfinite(rays_from_pixels(estimate.lens, border(estimate.size_px)))):
        warnings.append(
            "the edge of the image sees farther than 86 degrees from the lens's axis, or than its "
            "model reaches: pixels there are not measured"
            if is_fisheye(estimate.lens)
            else "the distortion cannot be undone at the edge of the image: pixels there are not "
            "measured; add pictures that reach it"
        )
    return tuple(warnings)


def _focal_share(estimate: LensEstimate) -> float:
    """One sigma of the focal length as a share of it, the larger of x and y."""
    lens, sigma = estimate.lens, estimate.sigma
    return float(max(sigma[FX] / abs(lens[FX]), sigma[FY] / abs(lens[FY])))


def _refuse_held_out(camera: str, held_out_squares: float) -> None:
    if held_out_squares > _SQUARES_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: no lens explains the pictures; corners left out of the fit are "
            f"{held_out_squares:.2f} squares off (.01 is good, {_SQUARES_REFUSED:g} the limit). Is "
            "the board flat and rigid, are all pictures of the same camera, lens and focus, is "
            "--board its number of inner corners? Was --model given, and is it the lens's? Lenses "
            "that see more than 170 degrees cannot be described"
        )


def _refuse_geometry(estimate: LensEstimate) -> None:
    camera, covered = estimate.camera, estimate.coverage
    if not _is_possible(estimate):
        lens = estimate.lens
        raise CalibrationError(
            f"camera {camera!r}: the pictures do not determine the lens: the best fit has its "
            f"centre at {lens[CX]:.0f}, {lens[CY]:.0f} px and a focal length of {lens[FX]:.0f} px, "
            f"which no camera has. Was the board never tilted? {_HOW_TO}"
        )
    if covered.normals_deg < _PARALLEL_DEG:
        raise CalibrationError(
            f"camera {camera!r}: the board was always held at about the same angle "
            f"({_tilt_text(covered)}), so focal length and distance cannot be told apart. {_HOW_TO}"
        )
    focal_share = _focal_share(estimate)
    if not np.isfinite(focal_share) or focal_share > _FOCAL_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: the pictures leave the focal length uncertain by "
            f"{100 * focal_share:.1f} % (at most {100 * _FOCAL_REFUSED:g} %; board: "
            f"{_tilt_text(covered)}; corners cover {100 * covered.share:.0f} % of the image). "
            f"{_HOW_TO}"
        )
    if covered.share < _COVERED_REFUSED:
        raise CalibrationError(
            f"camera {camera!r}: corners cover {100 * covered.share:.0f} % of the image (at least "
            f"{100 * _COVERED_REFUSED:.0f} % are needed; missing: "
            f"{covered.missing or 'all over'}). {_HOW_TO}"
        )


def _is_possible(estimate: LensEstimate) -> bool:
    """Whether the principal point is in the picture, and the focal length one that lenses have."""
    lens, (width, height) = estimate.lens, estimate.size_px
    inside = 0 <= lens[CX] < width and 0 <= lens[CY] < height
    return bool(inside and all(_FOCALS[0] <= lens[axis] / width <= _FOCALS[1] for axis in (FX, FY)))


def _tilt_text(covered: Coverage) -> str:
    tilts = covered.tilt_deg
    return (
        f"its normals are at most {covered.normals_deg:.0f} degrees apart, its tilts "
        f"{min(tilts):.0f} to {max(tilts):.0f}"
    )


def border(size_px: tuple[int, int]) -> Array:
    """Pixels (n, 2) around the edge of the picture."""
    width, height = size_px
    x = np.linspace(0.0, width - 1.0, _BORDER_X)
    y = np.linspace(0.0, height - 1.0, _BORDER_Y)
    along_x = [np.stack([x, np.full_like(x, edge)], axis=1) for edge in (0.0, height - 1.0)]
    along_y = [np.stack([np.full_like(y, edge), y], axis=1) for edge in (0.0, width - 1.0)]
    return np.concatenate(along_x + along_y)
