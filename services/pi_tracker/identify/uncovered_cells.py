"""What a hand uncovers of a thing in the room, known at once by what was known beside it. Pure.

A static thing is learnt where it is seen for some frames. Behind a finger that moves on it is not,
and the strip that appears is as near to the hand as its markers are, and of a marker's size.
"""

from __future__ import annotations

import cv2
import numpy as np

from services.pi_tracker.identify.cell_colors import Gate, agree
from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.noise import Noise

# Cells are compared with the mean of those that are known in a square about them, of so many cells,
# and then once more from there, up to so often. With the gate of cells that were seen before (5
# sigmas and 3 levels) it spread into markers before things of their own colour: .963 of the green
# tips of a hard room found instead of .982 (python benchmarks/hard.py --first-seed 11 --seeds 1
# --frames 1000), with 3 and 2 .979. In four clips of the other renderer with things in a paint's
# colour 38 and 37 markers were then on something else, with either gate.
_SQUARE, _STEPS = (9, 9), 6
_GATE: Gate = 2.5, 1.0
# Of more than was known to begin with, nobody knows what it is: a few cells of a marker that were
# learnt while it stood still spread over all of it.
_MOST = 1.0


def with_uncovered(
    static: Image, inside: Image, yuv: Image, noise: Noise, least_cells: int
) -> Image:
    """The static cells (h, w) of a blob, and those that look like static ones beside them.

    inside: where the blob is, not 0; yuv (h, w, 3): as the cells look now. Where fewer than
    least_cells are not static, no others are looked for.
    """
    blob = inside > 0
    known = static & blob
    count, cells = np.count_nonzero(known), np.count_nonzero(blob)
    if not count or cells - count < least_cells:
        return known
    found = known.copy()
    for _ in range(_STEPS):
        weights = found.astype(np.float32)
        near = _sum_about(weights)
        reached = (near > 0.5) & ~found & blob
        if not reached.any():
            break
        mean = _sum_about(yuv * weights[..., None]) / np.maximum(near, 1.0)[..., None]
        alike = reached & agree(yuv, mean, noise, _GATE)
        if not alike.any():
            break
        found |= alike
    more = np.count_nonzero(found) - count
    return found if more <= _MOST * count else known


def _sum_about(values: Image) -> Image:
    """Sums over the square about each cell, (h, w) or (h, w, channels)."""
    border = cv2.BORDER_CONSTANT
    return cv2.boxFilter(values, -1, _SQUARE, normalize=False, borderType=border)
