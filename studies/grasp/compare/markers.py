"""Which markers a finger needs: angles recovered from fewer of the measured joints. Pure.

A marker is a dot on a joint or the tip; the tip's direction may be measured by itself (a nail's
edge). From a choice of them the three flexions are fitted, frame by frame, together with the place
of the MCP joint, which moves little: without a dot it is known from the hand to a few mm. What a
choice does not tell is filled by the usual finger: DIP near 2/3 PIP, as loosely as people differ.

Two errors for each choice: *predicted*, from the noise through the covariance of the fit, and
*found*, against the angles measured with all markers. Found is larger where a finger is not the
usual one: that is what noise alone cannot say. The choice of all joints but the base line's is
what the measured angles come from: its found error shows how well the fit itself does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.compare.paths import TipPath
from studies.grasp.planar import TWO_THIRDS, joints_of

# In the order of FingerTrack.joints, and the direction.
MARKERS = ("mcp", "pip", "dip", "tip", "direction")
# rad; how far DIP is from 2/3 PIP in people: Leap, OpenXR and the five of the study 3 to 20 deg.
_LAW_RAD = np.deg2rad(12.0)
# Share of the finger's length to which the MCP joint is known without a marker: 3 mm of 80, what
# skin over a knuckle moves.
_MCP_SHARE = 0.035
# rad; a guess at each flexion, so weak that one marker counts a thousand times as much; it only
# keeps what nothing tells from running away.
_LOOSE_RAD = np.deg2rad(60.0)
_MIDDLE_RAD = np.deg2rad([35.0, 50.0, 33.0])
_ITERATIONS = 25
# rad, and lengths of the finger; no step is larger: done.
_SMALL_RAD = 1e-4
_FRAMES = 200
_STARTS = (0.15, 0.5, 0.9)


class Noise(NamedTuple):
    """One standard deviation of what is measured."""

    point: float  # along each axis, lengths of the finger
    direction_rad: float


class Choice(NamedTuple):
    """One set of markers."""

    markers: tuple[str, ...]
    predicted_deg: tuple[float, float, float]  # RMS over frames, MCP, PIP, DIP
    found_deg: tuple[float, float, float]  # against all markers; NaN without measured angles
    found_p95_deg: float
    found_max_deg: float

    @property
    def worst_deg(self) -> float:
        """The larger of predicted and found RMS of the worst joint: what the choice is good for."""
        return float(np.nanmax([*self.predicted_deg, *self.found_deg]))


def choices(
    paths: Sequence[TipPath], noise: Noise, begun: Callable[[int], Callable[[], None]]
) -> list[Choice]:
    """Every set of the markers that were measured, the fewest first, the best first among them.

    begun is told how many there are, and gives what is called after each.
    """
    joints = np.concatenate([t.joints / one.length for one in paths for t in one.tracks])
    lengths = np.concatenate(
        [
            np.tile(one.lengths / one.length, (len(t.times_s), 1))
            for one in paths
            for t in one.tracks
        ]
    )
    direction = np.concatenate([t.direction_rad for one in paths for t in one.tracks])
    measured = np.concatenate([t.angles_rad for one in paths for t in one.tracks])
    seen = np.concatenate([joints.reshape(-1, 8), direction[:, None], measured], axis=1)
    has = [np.isfinite(joints[:, k]).any() for k in range(4)] + [np.isfinite(direction).any()]
    names = [name for name, known in zip(MARKERS, has, strict=True) if known]
    used = [k for name in names for k in _columns(name)]
    rows = np.isfinite(seen[:, used]).all(axis=1)
    # Of many frames a few hundred say the same.
    keep = np.flatnonzero(rows)[:: max(1, int(rows.sum()) // _FRAMES)]
    sets = [
        chosen
        for count in range(1, len(names) + 1)
        for chosen in combinations(names, count)
        if chosen not in (("mcp",), ("direction",), ("mcp", "direction"))
    ]
    advance, made = begun(len(sets)), []
    for chosen in sets:
        made.append(_choice(chosen, seen[keep], lengths[keep], noise))
        advance()
    return sorted(made, key=lambda one: (len(one.markers), one.worst_deg))


def fewest(made: Sequence[Choice], wanted_deg: float) -> Choice | None:
    """The smallest set whose worst joint is as good as wanted; None if none is."""
    return next((one for one in made if one.worst_deg <= wanted_deg), None)


def noise_of(paths: Sequence[TipPath], point_mm: float) -> Noise:
    """From the recordings' own sigma where they tell it, else from point_mm (of 80 mm).

    A direction is that of two dots on the distal phalanx.
    """
    sigmas = np.concatenate([t.sigma / one.length for one in paths for t in one.tracks])
    known = sigmas[np.isfinite(sigmas) & (sigmas > 0.0)]
    point = float(np.median(known)) if known.size else point_mm / 80.0
    distal = float(np.mean([one.lengths[2] / one.length for one in paths]))
    return Noise(point, float(np.sqrt(2.0) * point / distal))


def _columns(name: str) -> list[int]:
    """Of the table of what was seen: joints (8), direction, angles (3)."""
    k = MARKERS.index(name)
    return [8] if name == "direction" else [2 * k, 2 * k + 1]


def _choice(chosen: tuple[str, ...], seen: Array, lengths: Array, noise: Noise) -> Choice:
    columns = [k for name in chosen for k in _columns(name)]
    sigma = np.array([noise.direction_rad if k == 8 else noise.point for k in columns])
    best, least = np.zeros((len(seen), 5)), np.full(len(seen), np.inf)
    for share in _STARTS:
        start = np.zeros((len(seen), 5))
        start[:, :3] = share * np.deg2rad([90.0, 105.0, 75.0])
        x, cost = _fitted(start, seen[:, columns], columns, sigma, lengths)
        better = cost < least
        best[better], least[better] = x[better], cost[better]
    # Where the finger was, rather than where few markers have it.
    measured = np.isfinite(seen[:, 9:12])
    posture = np.concatenate([np.where(measured, seen[:, 9:12], best[:, :3]), best[:, 3:]], axis=1)
    covariance = np.linalg.inv(_normal(posture, seen[:, columns], columns, sigma, lengths)[0])
    variance = np.diagonal(covariance, axis1=1, axis2=2)[:, :3]
    off = np.rad2deg(best[:, :3] - seen[:, 9:12])
    known = np.isfinite(off).all(axis=1)
    found = np.sqrt((off[known] ** 2).mean(axis=0)) if known.any() else np.full(3, np.nan)
    sizes = np.abs(off[known]) if known.any() else np.full((1, 3), np.nan)
    predicted = np.rad2deg(np.sqrt(variance.mean(axis=0)))
    return Choice(
        chosen,
        (float(predicted[0]), float(predicted[1]), float(predicted[2])),
        (float(found[0]), float(found[1]), float(found[2])),
        float(np.percentile(sizes, 95)),
        float(sizes.max()),
    )


def _fitted(
    start: Array, seen: Array, columns: list[int], sigma: Array, lengths: Array
) -> tuple[Array, Array]:
    """Levenberg-Marquardt over all frames at once: x (n, 5) angles and MCP, and cost (n,)."""
    x, damping = start.copy(), np.full(len(start), 1e-2)
    H, g, cost = _normal(x, seen, columns, sigma, lengths)
    for _ in range(_ITERATIONS):
        scale = damping[:, None, None] * np.eye(5) * np.diagonal(H, axis1=1, axis2=2)[:, None]
        step = np.linalg.solve(H + scale, g[..., None])[..., 0]
        trial = x + np.clip(step, -0.5, 0.5)
        H_new, g_new, cost_new = _normal(trial, seen, columns, sigma, lengths)
        better = cost_new < cost
        x[better], H[better], g[better] = trial[better], H_new[better], g_new[better]
        cost = np.where(better, cost_new, cost)
        damping = np.where(better, 0.2 * damping, 8.0 * damping)
        if np.abs(step).max() < _SMALL_RAD:
            break
    return x, cost


def _normal(
    x: Array, seen: Array, columns: list[int], sigma: Array, lengths: Array
) -> tuple[Array, Array, Array]:
    """H (n, 5, 5) = J'J, g (n, 5) = -J'e and the cost (n,), everything in standard deviations."""
    angles, root = x[:, :3], x[:, 3:]
    joints = joints_of(angles, lengths)
    n = len(x)
    predicted = np.column_stack([(joints + root[:, None]).reshape(n, 8), angles.sum(axis=1)])
    J = np.zeros((n, 9, 5))
    for j in range(3):
        # Joints beyond the one that turns move at right angles to their arm.
        arm = joints - joints[:, j : j + 1]
        beyond = np.arange(4) > j
        J[:, 0:8:2, j] = np.where(beyond, -arm[..., 1], 0.0)
        J[:, 1:8:2, j] = np.where(beyond, arm[..., 0], 0.0)
    J[:, 8, :3] = 1.0
    J[:, 0:8:2, 3] = J[:, 1:8:2, 4] = 1.0
    e = (predicted[:, columns] - seen) / sigma
    J = J[:, columns] / sigma[:, None]
    priors = np.zeros((6, 5))
    priors[0, 1:3] = -TWO_THIRDS / _LAW_RAD, 1.0 / _LAW_RAD
    priors[1:4, :3] = np.eye(3) / _LOOSE_RAD
    priors[4:, 3:] = np.eye(2) / _MCP_SHARE
    offset = np.concatenate([[0.0], _MIDDLE_RAD / _LOOSE_RAD, [0.0, 0.0]])
    e = np.concatenate([e, x @ priors.T - offset], axis=1)
    J = np.concatenate([J, np.tile(priors, (n, 1, 1))], axis=1)
    return (
        np.einsum("nki,nkj->nij", J, J),
        -np.einsum("nki,nk->ni", J, e),
        (e**2).sum(axis=1),
    )
