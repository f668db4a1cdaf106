"""A hand keeps its shape for a moment, but for its fingers' own motion: what that says of depth.

A shape that was known is moved as one piece onto what is known now (rigid_fit.py), and each
landmark is told between its own estimate and its place in the shape, as sure as hands deform. How
much each landmark does is learnt from the shapes of the last frames; where the estimates contradict
even that, the shape counts for less. The filter never hears of it. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.geometry.normal_equations import invert_symmetric
from services.fusion.one_camera.rigid_fit import RigidFit, jacobian, start_fit, step_fit

# Landmarks that make a shape: with fewer nothing is left over.
LEAST = 3
# How long what is learnt of a landmark's own motion lasts, s; variances about the shape count so
# many times, beside this sigma, m. Chosen on the tuning half of points while every landmark had a
# filter of its own and shapes were held in each frame: with .0004 m taps were .86 for .64 mm off.
MEMORY_S, TIMES, FLOOR_M = 0.15, 3.0, 0.001
# A landmark's own motion in a frame before anything is learnt, m.
FIRST_M = 0.003
# Steps of the fit; at each the variance of the shape grows with the square of how much more the
# estimates contradict it than by chance.
STEPS = 5
# A step of less, m and rad, was the last: it is a thousandth of what anything is rounded to.
SETTLED = 1e-9


class ShapeMemory(NamedTuple):
    """Where L landmarks were at the last instant that a shape was taken from."""

    time_s: Array  # (1,)
    places: Array  # (L, 3) NaN where not known
    deformed: Array  # (L,) variance of a landmark about the shape of a frame before, m^2
    eye: Array  # (3,) the middle of the cameras


def empty_memory(landmarks: int, eye: Array) -> ShapeMemory:
    """Nothing known yet; eye (3,): the middle of the cameras."""
    places = np.full((landmarks, 3), np.nan)
    return ShapeMemory(np.full(1, -np.inf), places, np.full(landmarks, FIRST_M**2), eye)


@njit(cache=True, error_model="numpy")
def learn_deformation(
    memory: ShapeMemory, hand: Ints, known: Bools, places: Array, time_s: float, span_s: float
) -> None:
    """Learn from places (L, 3) that are known (L,) at an instant about span_s after the last one.

    hand (L,): whose each landmark is. Only what is across the view counts: depth is less sure.
    """
    if 0.0 < time_s - memory.time_s[0] <= 1.5 * span_s:
        keep = math.exp(-span_s / MEMORY_S)
        both = known & np.isfinite(memory.places[:, 0])
        for number in range(hand.max() + 1):
            rows = np.flatnonzero(both & (hand == number))
            if rows.size < LEAST:
                continue
            before, now = memory.places[rows], places[rows]
            fit, arms = _fit_alike(before, now)
            for n in range(rows.size):
                off = now[n] - fit.centre - fit.R @ arms[n]
                sight = now[n] - memory.eye
                along = (off @ sight) ** 2 / (sight @ sight)
                across = 0.5 * max(off @ off - along, 0.0)
                learnt = keep * memory.deformed[rows[n]] + (1.0 - keep) * across
                memory.deformed[rows[n]] = max(learnt, 0.5 * across)
    memory.time_s[0] = time_s
    for row in range(known.size):
        memory.places[row] = places[row] if known[row] else np.full(3, np.nan)


@njit(cache=True, error_model="numpy")
def _fit_alike(before: Array, now: Array) -> tuple[RigidFit, Array]:
    """Places before moved onto places now (n, 3) by least squares, and their arms before (n, 3)."""
    fit = start_fit(before)
    arms = before - fit.centre
    weights = np.zeros((before.shape[0], 3, 3))
    for n in range(before.shape[0]):
        weights[n] = np.eye(3) / FLOOR_M**2
    for _ in range(STEPS):
        before_step = fit.moved.copy()
        step_fit(fit, arms, now, weights)
        # Metres and radians: a hand hardly turns in a frame, and three steps are the rule.
        if np.abs(fit.moved - before_step).max() < SETTLED:
            break
    return fit, arms


@njit(cache=True, error_model="numpy")
def hold_shape(
    deformed: Array, before: Array, before_covs: Array, places: Array, covs: Array
) -> None:
    """Weigh n places (n, 3), (n, 3, 3) against the shape they had a frame before; in place.

    before (n, 3), before_covs (n, 3, 3): that shape; deformed (n,): variances about it, m^2.
    """
    count = places.shape[0]
    fit = start_fit(before)
    arms = before - fit.centre
    weights, total = np.empty((count, 3, 3)), np.empty((3, 3))
    larger = 1.0
    for step in range(STEPS):
        for n in range(count):
            for i in range(3):
                for j in range(3):
                    total[i, j] = covs[n, i, j] + larger * before_covs[n, i, j]
                total[i, i] += larger * (TIMES * deformed[n] + FLOOR_M**2)
            if not invert_symmetric(total, weights[n]):
                return
        squares = step_fit(fit, arms, places, weights)
        # The first step only brings the shape there.
        if step > 0:
            larger *= max(1.0, squares / (3.0 * count - 6.0)) ** 2
    pose_cov = np.linalg.inv(fit.information)
    J = np.empty((3, 6))
    for n in range(count):
        arm = fit.R @ arms[n]
        jacobian(arm, J)
        share = covs[n] @ weights[n]  # (3, 3) how much the shape counts
        by_pose = share @ J  # (3, 6)
        off = fit.centre + arm - places[n]
        shape_cov = larger * (before_covs[n] + (TIMES * deformed[n] + FLOOR_M**2) * np.eye(3))
        told = share @ shape_cov + by_pose @ pose_cov @ by_pose.T
        places[n] += share @ off
        covs[n] = 0.5 * (told + told.T)
