"""Standard deviation of a camera's noise per cell: the scale of every marker's sigma.

After Immerkaer (Fast noise variance estimation, CVIU 1996), on a few rows of cells. Second
differences cancel what changes slowly across the scene, and their median is robust to edges. Pure.
Texture all over the picture is taken for noise: sigmas are then too large, never too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.yuv_planes import Picture

# Rows of cells that are sampled, and frames from one estimate to the next: noise changes with the
# light, in seconds.
_ROWS, _PERIOD_FRAMES = 8, 16
# Weight of a new estimate in the running mean.
_NEW_WEIGHT = 0.3
# Edges are cut off at three medians, two standard deviations of noise. What is left of a normal
# distribution has a mean size of 0.725 standard deviations (the median alone would know whole
# levels only). A second difference has sqrt(1 + 4 + 1) times the noise.
_CUT_MEDIANS, _MEAN_OF_CUT = 3.0, 0.725 * 6.0**0.5
# Demosaicing correlates neighbours, so that differences show too little noise: 1.17 measured on
# bilinear interpolation, 1.05 on white noise.
_CORRELATION_GAIN = 1.15
# Rounding to whole grey levels is noise, too: 1 / sqrt(12).
_ROUNDING_SIGMA = 0.29


@dataclass
class Noise:
    """Standard deviations of luma (mean of 2x2 pixels) and of chroma per cell, grey levels."""

    luma: float = 1.0
    chroma: float = 1.0
    _frames: int = 0

    def update(self, picture: Picture) -> None:
        """Take in a frame; one in _PERIOD_FRAMES is measured."""
        if self._frames % _PERIOD_FRAMES == 0:
            width, height = picture.size
            rows = [
                picture.cells((0, y, width, y + 1))
                for y in range(height // (2 * _ROWS), height, max(1, height // _ROWS))
            ]
            luma = np.concatenate([row[0] for row in rows]).astype(np.int16)  # (r, w)
            chroma = np.concatenate([row[1] for row in rows]).astype(np.int16)  # (r, w, 2)
            weight = _NEW_WEIGHT if self._frames else 1.0
            self.luma += weight * (max(_sigma(luma[:, :, None]), _ROUNDING_SIGMA) - self.luma)
            self.chroma += weight * (max(_sigma(chroma), _ROUNDING_SIGMA) - self.chroma)
        self._frames += 1


def _sigma(rows: Image) -> float:
    """Standard deviation of the noise in rows (r, w, channels)."""
    if rows.shape[1] < 3:
        return 0.0
    differences = np.abs(rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:])
    cut = _CUT_MEDIANS * max(float(np.median(differences)), 1.0)
    return _CORRELATION_GAIN * float(differences[differences <= cut].mean()) / _MEAN_OF_CUT
