"""Standard deviation of a weighted centroid: from noise, and from what noise does not explain.

Pure.
"""

from __future__ import annotations

import math

# Light, shade and background move the centre by this much at any distance. They move it more where
# the edge is blurred, i.e. where the band in which the paint fraction is neither 0 nor 1 is wider
# than 1.75 px (blur, coloured light, dark sides). RMS of the simulator's hands, random seeds 1-10:
# .09 px resting at 0.5 and 1.0 m, .14 moving at 0.7 m (.2 where the band is wider than 1.8 px), .47
# and .65 in coloured light where it is 2.1 and 2.4 px. Error over sigma is then .7-.8 resting, 1.1
# moving, 1.25 in coloured light.
MISFIT_PX, MISFIT_PER_PX, SHARP_BAND_PX = 0.1, 1.0, 1.75


def noise_sigma_px(
    variances: list[list[float]], area_px2: float, x_px: float, y_px: float, slope: float
) -> float:
    """Standard deviation of each coordinate from the noise.

    variances are the raw moments [i][j], up to i, j = 2, of the variances of the cells' paint
    fractions, x_px and y_px the centroid in the tile, slope the weights' derivative by the
    fraction.
    """
    # In cells, of which one is two pixels wide.
    x, y = (x_px - 0.5) / 2.0, (y_px - 0.5) / 2.0
    # Variance times squared distance from the centroid, summed over cells.
    about = (
        variances[0][2]
        + variances[2][0]
        - 2.0 * (x * variances[0][1] + y * variances[1][0])
        + (x * x + y * y) * variances[0][0]
    )
    # Four pixels that move together: 4^2 times the cell's variance; pixels for cells: 2^2; the mean
    # of two coordinates: 1 / 2.
    return slope * math.sqrt(32.0 * max(about, 0.0)) / area_px2


def misfit_sigma_px(edge_px2: float, area_px2: float) -> float:
    """Standard deviation of each coordinate from light and blur.

    edge_px2 is the area of the pixels in which the paint fraction is neither 0 nor 1.
    """
    radius = math.sqrt(area_px2 / math.pi)
    # The band of a disc has an area of 2 pi r times its width.
    band_px = edge_px2 / (2.0 * math.pi * radius)
    return MISFIT_PX + MISFIT_PER_PX * max(band_px - SHARP_BAND_PX, 0.0)
