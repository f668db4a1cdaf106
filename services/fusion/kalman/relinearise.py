"""A look linearised anew where it leads: an iterated extended Kalman filter. Compiled.

Bell, Cathey, "The iterated Kalman filter update as a Gauss-Newton method", IEEE Trans. Automatic
Control 38(2), 1993. Between frames a tenth of a second apart a hand's depth is known to
centimetres, and the tangent of its ray is off by pixels there; a landmark that one camera saw alone
is decimetres off along its ray, and the other camera's first look threw it as far to the other
side.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.measurement import (
    Innovation,
    Look,
    Shift,
    cross_cov,
    invert_innovation_cov,
    predict_ray,
    squared_distance,
)

# A look whose ray is bent by more of its sigmas where it moves its landmark is linearised anew
# there; from twice a landmark's distance to it takes five rounds. Moves beyond the largest room are
# none. (Tuning motions, RMS: with .3 sigmas 1 % more without lag at 30 frames a second, 2 % more at
# two frames at 15, and 12 % less where 60 % of the frames are lost.)
_BENT, _FARTHEST_M, _ROUNDS = 1.0, 100.0, 8


@njit(cache=True, error_model="numpy")
def linearise_where_it_leads(
    x: Array, P: Array, taken: Array, known: int, look: Look, out: Innovation
) -> None:
    """Linearise an innovation anew as long as rays are bent where it moves its landmark.

    The arguments are those of innovate(), which made it. After the look was gated and weighed by
    what was expected: where a look is of another thing, some place far off would explain it.
    """
    for _ in range(_ROUNDS):
        moved = _shift(look, out)
        far = not moved[0] ** 2 + moved[1] ** 2 + moved[2] ** 2 < _FARTHEST_M**2
        if far or _squared_bend(x, look, moved, out) <= _BENT**2 * look.ray_variance:
            return
        # Past the camera: half the way may be in front of it.
        while not predict_ray(x, look, moved, out):
            moved = (0.5 * moved[0], 0.5 * moved[1], 0.5 * moved[2])
        cross_cov(P, taken, known, look, out)
        if invert_innovation_cov(out.K, look, out) <= 0.0:
            return
        out.distance[0] = squared_distance(out)


@njit(cache=True, error_model="numpy")
def _squared_bend(x: Array, look: Look, shift: Shift, out: Innovation) -> float:
    """How far the ray to a look's landmark, moved by so much, is off its tangent, squared.

    The tangent is that of nu and H. Infinite if that is not in front of the camera.
    """
    axes = (x.shape[0] - 1) // 3
    first = 3 * look.landmark
    delay_s, half = look.delay_s, 0.5 * look.delay_s * look.delay_s
    R, t = look.R, look.t
    u, v, depth = t[0], t[1], t[2]
    for i in range(3):
        at = first + i
        place = x[at] + delay_s * x[axes + at] + half * x[2 * axes + at] + shift[i]
        u += R[0, i] * place
        v += R[1, i] * place
        depth += R[2, i] * place
    if not depth > 0.0:
        return math.inf
    total = 0.0
    for k in range(2):
        off = (u if k == 0 else v) / depth - look.ray[k] + out.nu[k] + out.drift[k] * x[3 * axes]
        for i in range(3):
            off -= out.H[k, i] * shift[i]
        total += off * off
    return total


@njit(cache=True, error_model="numpy")
def _shift(look: Look, innovation: Innovation) -> Shift:
    """How far (m) a look moves its landmark, as seen at its instant; K has P H^T."""
    PHt, nu, S_inverse = innovation.K, innovation.nu, innovation.S_inverse
    axes = (PHt.shape[1] - 1) // 3
    delay_s, half = look.delay_s, 0.5 * look.delay_s * look.delay_s
    by0 = S_inverse[0, 0] * nu[0] + S_inverse[0, 1] * nu[1]
    by1 = S_inverse[1, 0] * nu[0] + S_inverse[1, 1] * nu[1]
    p = 3 * look.landmark
    v, a = p + axes, p + 2 * axes
    x = by0 * (PHt[0, p] + delay_s * PHt[0, v] + half * PHt[0, a])
    y = by0 * (PHt[0, p + 1] + delay_s * PHt[0, v + 1] + half * PHt[0, a + 1])
    z = by0 * (PHt[0, p + 2] + delay_s * PHt[0, v + 2] + half * PHt[0, a + 2])
    x += by1 * (PHt[1, p] + delay_s * PHt[1, v] + half * PHt[1, a])
    y += by1 * (PHt[1, p + 1] + delay_s * PHt[1, v + 1] + half * PHt[1, a + 1])
    z += by1 * (PHt[1, p + 2] + delay_s * PHt[1, v + 2] + half * PHt[1, a + 2])
    return x, y, z
