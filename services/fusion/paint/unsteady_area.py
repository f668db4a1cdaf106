"""Paint whose area flickers is located no better than that. Compiled.

JPEG's blocks, a shadow's edge, ragged paint and what begins to hide it take pieces of a marker away
and give them back. Its centre goes to and fro with them, and each of these blobs is as sharp as
any: markers of a hand at rest, told to .1 px, wandered by a pixel. When a finger turns, its paint
looks larger or smaller to all cameras; so what tells is the ratio of the areas that two of them
see. How unsteady it is ranks the scatter of looks better than the tracker's sigma does: correlation
.67 and .41 on the tuning clips of other_renderer.py, .48 and .36 on the tuning half of
held_out.py's pictures. (A camera's own area: .70 and .42; but where hands turn fast the filter then
waits for looks that are right, and is 4 % worse without lag.)
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array

# How long a ratio is remembered, and a change of it counts. After a gap it begins anew.
_RATIO_S, _CHANGE_S, _GAP_S = 0.1, 0.07, 0.2
# Scatter of a ray against how unsteady the ratio is, in roots of the area: the likeliest on both
# tuning halves is .2. And what of it is in the tracker's sigma already. (Geometric mean of RMS, 95
# % and maximum of the filter's points at two frames: our pictures .997, 1.007, .964 times as
# without, the other renderer's .97, .95, .86. With .01 taken off 1.002, 1.013, .98 and 1.01, .99,
# 1.36; with .3 and .012 1.004, 1.012, 1.0 and 1.01, 1.0, 1.01.)
_SCATTER, _STEADY = 0.2, 0.006


@njit(cache=True)
def unsteady_sigma(known: Array, ratio: float, passed_s: float) -> float:
    """What is to be added, squared, to the sigma of a look, in roots of its area.

    ratio: of its area to another camera's; passed_s: since the look before. known (2,): mean and
    variance of the ratio's logarithm, taken on to this look; NaN at first.
    """
    now = math.log(ratio)
    if math.isnan(known[0]) or passed_s > _GAP_S:
        known[0], known[1] = now, 0.0
        return 0.0
    learned, new = 1.0 - math.exp(-passed_s / _RATIO_S), 1.0 - math.exp(-passed_s / _CHANGE_S)
    off = now - known[0]
    known[0] += learned * off
    known[1] += new * ((1.0 - learned) * off * off - known[1])
    return math.sqrt(max(_SCATTER**2 * known[1] - _STEADY**2, 0.0))
