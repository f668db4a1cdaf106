"""What the registration leaves on seconds that took no part in its fit. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.objects.bundle.reprojection import Scene, Unknowns, reproject
from services.calibrator.objects.bundle.solve import Sampler, Solution, refine
from services.calibrator.objects.result import Residuals
from services.calibrator.objects.sightings import Bools

# Parts of the recording that are left out by turns, each of whole stretches of this many seconds.
_PARTS, _STRETCH_S = 5, 2.0
# Ratio of root mean square over both axes to the median length of residuals that are normal.
_RMS_FROM_MEDIAN = 0.849


def residuals_of(at: Scene, unknowns: Unknowns) -> Residuals:
    """The residuals of these sightings, from their medians: outliers do not count."""
    pixels, metres = _lengths(at, unknowns)
    return _robust(pixels, metres)


def held_out(sample: Sampler, found: Solution) -> Residuals:
    """The residuals of each part, by the fit to the others."""
    part = np.floor(found.scene.stamps_s / _STRETCH_S).astype(np.int64) % _PARTS
    pixels, metres = [np.zeros(0)], [np.zeros(0)]
    for number in range(_PARTS):
        if not (part == number).any() or (part == number).all():
            continue
        solution = refine(_without(sample, number), found.unknowns, found.noise, 0)
        left_out = _part(sample(solution.unknowns.late_s), number, keep=True)
        own_px, own_m = _lengths(left_out, solution.unknowns)
        pixels.append(own_px)
        metres.append(own_m)
    return _robust(np.concatenate(pixels), np.concatenate(metres))


def _without(sample: Sampler, number: int) -> Sampler:
    return lambda late_s: _part(sample(late_s), number, keep=False)


def _part(at: Scene, number: int, *, keep: bool) -> Scene:
    own: Bools = np.floor(at.stamps_s / _STRETCH_S).astype(np.int64) % _PARTS == number
    return at.only(own if keep else ~own)


def _lengths(at: Scene, unknowns: Unknowns) -> tuple[Array, Array]:
    result = reproject(at, unknowns, np.zeros(3))
    pixels = np.linalg.norm(result.residual_px, axis=1)
    return pixels, pixels * result.depth_m / at.focals_px


def _robust(pixels: Array, metres: Array) -> Residuals:
    if not len(pixels):
        return Residuals(float("nan"), float("nan"))
    px, m = (_RMS_FROM_MEDIAN * float(np.median(values)) for values in (pixels, metres))
    return Residuals(px, 1e3 * m)
