"""Postures of a hand that show its dots where the first picture has them. Pure.

One picture leaves several: a finger bent towards the camera or away, a left hand or a right one.
Each is the end of a least squares fit (Levenberg-Marquardt) from a random direction, or from what
another fit found, reflected in the plane of the picture: from afar a left hand looks there as a
right one did. The pictures that follow tell which is right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import rotation_from_quaternion
from services.pi_tracker.dots.body.rotations import turned
from services.pi_tracker.dots.body.skeleton import Skeleton
from services.pi_tracker.dots.motion import State, start

Array = npt.NDArray[np.float64]

# Directions tried of each side, rounds from each and at the end; the best postures that are kept,
# and none that is so much (nats) less likely than the best.
_DIRECTIONS, _ROUNDS, _LAST_ROUNDS, _KEPT, _WORSE_NATS = 24, 12, 30, 12, 10.0
# Of the ends of all fits, so many that differ are refined, and their reflections; two with no dot
# further apart than this are one, m. (15 dots of `grab`, seeds 2 to 4 of benchmarks/dots.py: what a
# fit begun at the truth ends at was among those of 16 alike for no seed, and is so for 3 and 4.)
_REFINED, _SAME_M = 12, 0.012
# A step turns nothing by more than this, rad. No hand is nearer than this, or further, m.
_LARGEST_TURN, _NEAREST_M, _FURTHEST_M = 0.6, 0.08, 3.0
_LIMIT_SIGMA = 0.15


class _Fits(NamedTuple):
    """k postures (k, size) with rotations (k, 3, 3) and sides (k,)."""

    postures: Array
    rotations: Array
    sides: Array

    def take(self, rows: npt.NDArray[np.intp]) -> _Fits:
        return _Fits(*(part[rows] for part in self))


def postures(
    skeleton: Skeleton, places: Array, sigmas: Array, seed: int = 0
) -> tuple[float, list[tuple[float, State]]]:
    """States and their scores (nats, the best 0) of dots at places (n, 2) with sigmas (n,), px.

    Before them, how far the best is from showing them and from a usual hand, nats.
    """
    random = np.random.default_rng(seed)
    turns = random.normal(size=(2 * _DIRECTIONS, 4))
    rotations = np.array([rotation_from_quaternion(q / np.linalg.norm(q)) for q in turns])
    begun = _placed(skeleton, places, rotations, np.repeat([1.0, -1.0], _DIRECTIONS))
    fits, costs, _ = _fitted(skeleton, places, 3.0 * sigmas, begun, _ROUNDS)
    fits = fits.take(np.array(_distinct(skeleton, fits, -costs)[:_REFINED]))
    fits = _Fits(*(np.concatenate(both) for both in zip(fits, _reflected(fits), strict=True)))
    fits, costs, told = _fitted(skeleton, places, sigmas, fits, _LAST_ROUNDS)
    scores = -costs - 0.5 * np.linalg.slogdet(told)[1]
    kept = _distinct(skeleton, fits, scores)
    facing = skeleton.facing(*fits)
    best, covs = float(scores[kept[0]]), np.asarray(np.linalg.inv(told), np.float64)
    return float(costs.min()), [
        (
            float(scores[k]) - best,
            start(
                skeleton,
                fits.postures[k],
                fits.rotations[k],
                float(fits.sides[k]),
                facing[k],
                covs[k],
            ),
        )
        for k in kept[:_KEPT]
        if scores[k] > best - _WORSE_NATS
    ]


def _distinct(skeleton: Skeleton, fits: _Fits, scores: Array) -> list[int]:
    """Rows of fits that differ, the best first."""
    points = skeleton.place(*fits, skeleton.facing(*fits))[0] - fits.postures[:, None, :3]
    kept: list[int] = []
    for k in np.argsort(-scores).tolist():
        if not any(
            fits.sides[k] == fits.sides[one] and np.abs(points[k] - points[one]).max() < _SAME_M
            for one in kept
        ):
            kept.append(k)
    return kept


def _reflected(fits: _Fits) -> _Fits:
    """The same angles of the other hand, near turned to far about its middle."""
    turned_over = np.diag([1.0, 1.0, -1.0]) @ fits.rotations @ np.diag([-1.0, 1.0, 1.0])
    return _Fits(fits.postures.copy(), turned_over, -fits.sides)


def _placed(skeleton: Skeleton, places: Array, rotations: Array, sides: Array) -> _Fits:
    """Relaxed hands of some directions, turned about the line of sight, put where the dots are."""
    begun = np.zeros((len(sides), skeleton.size))
    begun[:, 6 : skeleton.moving] = skeleton.usual
    facing = skeleton.facing(begun, rotations, sides)
    points, _ = skeleton.place(begun, rotations, sides, facing)
    middles = points.mean(axis=1)
    flat, seen = (points - middles[:, None])[..., :2], places - places.mean(axis=0)
    across = (flat[..., 0] * seen[:, 1] - flat[..., 1] * seen[:, 0]).sum(axis=1)
    about = np.zeros((len(sides), 3))
    about[:, 2] = np.arctan2(across, (flat * seen).sum(axis=(1, 2)))
    turns = turned(about)
    ratios = np.linalg.norm(flat, axis=(1, 2)) / max(float(np.linalg.norm(seen)), 1.0)
    begun[:, 2] = np.clip(skeleton.focal_px * ratios, 1.2 * _NEAREST_M, 0.6 * _FURTHEST_M)
    sight = (places.mean(axis=0) - skeleton.middle_px) / skeleton.focal_px
    begun[:, :2] = sight * begun[:, 2:3] - (turns @ middles[..., None])[:, :2, 0]
    return _Fits(begun, turns @ rotations, sides)


def _fitted(
    skeleton: Skeleton, places: Array, sigmas: Array, fits: _Fits, rounds: int
) -> tuple[_Fits, Array, Array]:
    """What fits best, begun with `fits`; the costs (k,), and the information (k, size, size)."""
    costs, slopes, told = _slopes(skeleton, places, sigmas, fits)
    damping, own = np.full(len(costs), 1e-2), np.arange(skeleton.size)
    for _ in range(rounds):
        damped = told.copy()
        damped[:, own, own] += damping[:, None] * (told[:, own, own] + 1e-6)
        steps = -np.asarray(np.linalg.solve(damped, slopes[..., None]), np.float64)[..., 0]
        tried = _stepped(skeleton, fits, steps)
        new = _slopes(skeleton, places, sigmas, tried)
        less = new[0] < costs
        fits = _Fits(*(_chosen(less, a, b) for a, b in zip(tried, fits, strict=True)))
        costs, slopes, told = (
            _chosen(less, a, b) for a, b in zip(new, (costs, slopes, told), strict=True)
        )
        damping = np.clip(np.where(less, 0.2, 6.0) * damping, 1e-6, 1e6)
    return fits, costs, told


def _chosen(which: npt.NDArray[np.bool_], yes: Array, no: Array) -> Array:
    return np.where(which.reshape(-1, *(1,) * (yes.ndim - 1)), yes, no)


def _stepped(skeleton: Skeleton, fits: _Fits, steps: Array) -> _Fits:
    turns = slice(3, skeleton.moving)
    steps[:, turns] = np.clip(steps[:, turns], -_LARGEST_TURN, _LARGEST_TURN)
    after = fits.postures + steps
    rotations = turned(after[:, 3:6]) @ fits.rotations
    after[:, 3:6] = 0.0
    after[:, 2] = np.clip(after[:, 2], _NEAREST_M, _FURTHEST_M)
    return _Fits(after, rotations, fits.sides)


def _slopes(
    skeleton: Skeleton, places: Array, sigmas: Array, fits: _Fits
) -> tuple[Array, Array, Array]:
    """Costs (k,), their derivatives (k, size) and the information (k, size, size)."""
    pixels, slopes = skeleton.project(*fits, skeleton.facing(*fits))
    count, size = len(pixels), skeleton.size
    rows = (slopes / sigmas[:, None, None]).reshape(count, -1, size)
    residuals = ((pixels - places) / sigmas[:, None]).reshape(count, -1)
    angles = fits.postures[:, 6 : skeleton.moving]
    outside = (angles - np.clip(angles, skeleton.least, skeleton.most)) / _LIMIT_SIGMA
    usual = (fits.postures @ skeleton.rows.T - skeleton.targets) / np.sqrt(skeleton.variances)
    person = fits.postures[:, skeleton.moving :] / skeleton.person
    parts = (residuals, outside, usual, person)
    costs = 0.5 * sum(np.sum(part**2, axis=1) for part in parts)
    scaled = skeleton.rows / np.sqrt(skeleton.variances)[:, None]
    first = np.einsum("krs,kr->ks", rows, residuals) + usual @ scaled
    first[:, 6 : skeleton.moving] += outside / _LIMIT_SIGMA
    first[:, skeleton.moving :] += person / skeleton.person
    told = rows.swapaxes(1, 2) @ rows + scaled.T @ scaled
    own = np.arange(size)
    # What nothing tells (how far the hand is) is told a little.
    told[:, own, own] += 1e-3
    told[:, own[6 : skeleton.moving], own[6 : skeleton.moving]] += (
        outside != 0.0
    ) / _LIMIT_SIGMA**2
    told[:, own[skeleton.moving :], own[skeleton.moving :]] += 1.0 / skeleton.person**2
    return np.asarray(costs), np.asarray(first), np.asarray(told)
