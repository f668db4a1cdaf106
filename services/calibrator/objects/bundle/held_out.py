"""What the registration leaves on seconds that took no part in its fit. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.objects.bundle.reprojection import Reprojection, Scene, reproject
from services.calibrator.objects.bundle.solve import Sampler, Solution, refine
from services.calibrator.objects.bundle.tracker_noise import Noise
from services.calibrator.objects.result import Residuals
from services.calibrator.objects.sightings import Bools

# Parts of the recording that are left out by turns, each of whole stretches of this many seconds.
_PARTS, _STRETCH_S = 5, 2.0
# Ratio of root mean square over both axes to the median length of residuals that are normal.
_RMS_FROM_MEDIAN = 0.849
# What is off by more standard deviations is a marker of something else, or a misled tracker, in
# any part.
_FAR = 10.0


def residuals_of(found: Solution) -> Residuals:
    """The residuals of the sightings that took part."""
    return _robust([_lengths(found.scene, found.result, found.noise)])


def held_out(sample: Sampler, found: Solution) -> Residuals:
    """The residuals of each part, by the fit to the others."""
    part = np.floor(found.scene.stamps_s / _STRETCH_S).astype(np.int64) % _PARTS
    lengths = []
    for number in range(_PARTS):
        if not (part == number).any() or (part == number).all():
            continue
        solution = refine(_without(sample, number), found.unknowns, found.noise, 0)
        left_out = _part(sample(solution.unknowns.late_s), number, keep=True)
        result = reproject(left_out, solution.unknowns, np.zeros(3))
        lengths.append(_lengths(left_out, result, found.noise))
    return _robust(lengths)


def _without(sample: Sampler, number: int) -> Sampler:
    return lambda late_s: _part(sample(late_s), number, keep=False)


def _part(at: Scene, number: int, *, keep: bool) -> Scene:
    own: Bools = np.floor(at.stamps_s / _STRETCH_S).astype(np.int64) % _PARTS == number
    return at.only(own if keep else ~own)


def _lengths(at: Scene, result: Reprojection, noise: Noise) -> tuple[Array, Array]:
    """Lengths of the residuals, px and m, but for those that are something else's."""
    pixels = np.linalg.norm(result.residual_px, axis=1)
    metres = pixels * result.depth_m / at.focals_px
    variance = noise.camera * at.sigma_px**2
    variance = variance + (noise.tracker_m * at.focals_px / result.depth_m) ** 2
    near = pixels <= _FAR * np.sqrt(variance)
    return pixels[near], metres[near]


def _robust(lengths: list[tuple[Array, Array]]) -> Residuals:
    """Robust RMS of an axis, from medians."""
    if not sum(len(pixels) for pixels, _ in lengths):
        return Residuals(float("nan"), float("nan"))
    px, m = (
        _RMS_FROM_MEDIAN * float(np.median(np.concatenate(values)))
        for values in zip(*lengths, strict=True)
    )
    return Residuals(px, 1e3 * m)
