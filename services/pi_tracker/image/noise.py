"""How noisy a camera's cells are: the scale of every marker's sigma.

Immerkaer's idea (Fast noise variance estimation, CVIU 1996) on a few rows of cells: second
differences cancel what the scene does slowly, and their median is blind to edges. Pure. A scene
textured all over is taken for noise, which makes sigmas too large, never too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.pi_tracker.image.frame import Image
from services.pi_tracker.image.yuv_planes import Picture

# Rows of cells looked at, and frames from one look to the next: noise changes with the light, in
# seconds.
_ROWS, _EVERY = 8, 16
# Share of a new estimate in the running one.
_NEW = 0.3
# Edges are cut off at three medians, two standard deviations of noise; what is left of a normal
# distribution has a mean size of 0.725 standard deviations (the median alone would know whole
# levels only). A second difference has sqrt(1 + 4 + 1) times the noise.
_CUT, _MEAN = 3.0, 0.725 * 6.0**0.5
# Demosaicing makes neighbours alike, so that differences show too little noise: 1.17 measured on
# bilinear interpolation, 1.05 on white noise.
_ALIKE = 1.15
# Rounding to whole grey levels is noise, too: 1 / sqrt(12).
_ROUNDING = 0.29


@dataclass
class Noise:
    """Standard deviations of luma (mean of 2x2 pixels) and of chroma per cell, grey levels."""

    luma: float = 1.0
    chroma: float = 1.0
    _frames: int = 0

    def look(self, picture: Picture) -> None:
        """Take in a frame; most are passed over."""
        if self._frames % _EVERY == 0:
            width, height = picture.size
            rows = [
                picture.cells((0, y, width, y + 1))
                for y in range(height // (2 * _ROWS), height, max(1, height // _ROWS))
            ]
            luma = np.concatenate([row[0] for row in rows]).astype(np.int16)
            chroma = np.concatenate([row[1] for row in rows]).astype(np.int16)
            share = _NEW if self._frames else 1.0
            self.luma += share * (max(_spread(luma[:, :, None]), _ROUNDING) - self.luma)
            self.chroma += share * (max(_spread(chroma), _ROUNDING) - self.chroma)
        self._frames += 1


def _spread(rows: Image) -> float:
    """Standard deviation of the noise in rows (r, w, channels)."""
    if rows.shape[1] < 3:
        return 0.0
    second = np.abs(rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:])
    cut = _CUT * max(float(np.median(second)), 1.0)
    return _ALIKE * float(second[second <= cut].mean()) / _MEAN
