"""The hand behind the dots: where a camera sees each of them, for given angles and lengths.

Many postures at a time (k of them), with derivatives. The hand is rhot.hand's, of an average adult;
bones and roots of fingers may differ from it, and are learnt as dots are followed. A left hand is a
right one mirrored. Pure.

A posture is a vector of p numbers: the hand's middle in the camera's frame (3, m), its turn since
its rotation (3, rad), the angles of each finger (4, rad), the logarithms of its bones' lengths to
the average adult's (3 for each finger), shifts (m) of fingers' roots and of dots on the palm, and
how far from the bone dots are, up and aside (2 of the thumb, 2 of the fingers, in radii of skin).

Dots are on the skin, on the side of a finger that the camera saw when it first saw them: up is that
way, `facing` (k, f) says where it is about each finger's bones, rad: 0 its back, 90 deg its right.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, JOINTS, default_hand, forward
from services.pi_tracker.dots.body.rotations import about_minus_x, about_y, cross, mirrored

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

# A camera's focal length by its picture's longer side, if nobody knows: that of phones and webcams.
FOCAL = 0.75
# No joint is nearer to a camera than this, m.
_NEAREST_M = 0.05
# Usual angles and their spread, rad: abduction and three flexions of the thumb, of a finger; wide,
# so that they decide only what nobody sees.
_USUAL = ((0.1, 0.1, 0.3, 0.4), (0.0, 0.5, 0.7, 0.4))
_SPREAD = ((0.35, 0.45, 0.45, 0.6), (0.2, 0.6, 0.7, 0.5))
# What joints of real hands do (the four Leap recordings), rad: least and most.
_LEAST = ((-0.6, -0.9, -0.5, -0.5), (-0.4, -0.5, -0.15, -0.3))
_MOST = ((0.8, 0.9, 1.2, 1.6), (0.4, 1.7, 2.0, 1.5))
# A finger's last joint follows the one before, RHOT eq. (4), within so much, rad.
_COUPLING, _COUPLING_SIGMA = 2.0 / 3.0, 0.35
# How people differ (and where on the skin dots are): of log lengths; of fingers' roots, of the
# thumb's and of dots on palm and wrist, m.
_LENGTH_SIGMA, _ROOT_SIGMA, _LOOSE_SIGMA = 0.12, 0.007, 0.015
# Dots are so many radii of skin above the bone, with so much spread, and aside; 0 would be ink
# within the joint, as the Leap recordings have it. That of a tip is so much before its end. (Ten
# clips of 8 dots like the tuning half of benchmarks/dots_pictures.py, before dots that turn away
# were expected as early: .8 and .35 up 82 % right, .5 and .5 88 %.)
_UP, _UP_SIGMA, _ASIDE_SIGMA, _BEFORE_END = 0.5, 0.5, 0.5, 0.5
# Shares of a flexion's acceleration: its own, its finger's (the thumb's is half) and of all
# fingers; and of an abduction.
_OWN, _FINGER, _ALL, _SPLAY = 0.55, 0.5, 0.7, 0.35


class _Chains(NamedTuple):
    """Fingers of k postures, in the hand's frame."""

    joints: Array  # (k, f, 4, 3) m
    # (k, f, 4, 3, 3) axes of the skin over each joint: half way between those of its bones.
    skins: Array
    axes: list[tuple[Array, Array]]  # (k, f, 3) of each angle: axis, and a point on it
    bones: list[Array]  # (k, f, 3) each, m


class Skeleton:
    """The fingers that n dots are on, seen by a camera."""

    def __init__(self, landmarks: Sequence[str], size_px: tuple[int, int]) -> None:
        """landmarks are of rhot.hand.JOINTS; size_px is the picture's."""
        joints = [JOINTS.index(name) for name in landmarks]
        rows = np.array([r for r in range(5) if set(joints) & set(CHAIN_JOINTS[r].tolist())], int)
        chained = CHAIN_JOINTS[rows].ravel().tolist()
        loose = [joint for joint in joints if joint not in chained]
        where = [*chained, *loose]
        # Of each dot, its point among the fingers' joints and the loose ones.
        self._points = np.array([where.index(joint) for joint in joints], np.int64)
        self.fingers, self.angles = len(rows), 4 * len(rows)
        # Of a posture: what moves, and all.
        self.moving = 6 + self.angles
        self._roots = self.moving + 3 * len(rows)
        self._ups = self._roots + 3 * len(rows) + 3 * len(loose)
        # Of the thumb, and of all other fingers: which of both each finger is of.
        self._group = np.unique(np.minimum(rows, 1), return_inverse=True)[1]
        groups = len(np.unique(self._group))
        self.size = self._ups + 2 * groups
        self.focal_px = FOCAL * max(size_px)
        self.middle_px = 0.5 * (np.array(size_px) - 1.0)
        model = default_hand("right")
        rest, _ = forward(model, np.eye(3), np.zeros(3), np.zeros((5, 4)))
        centre = rest[CHAIN_JOINTS[1:, 0]].mean(axis=0)
        digits = [model.digits[row] for row in rows]
        self._bases = np.array([d.base_m for d in digits]).reshape(-1, 3) - centre
        turns = [rotation_from_quaternion(d.base_wxyz) for d in digits]
        self._turns = np.array(turns).reshape(-1, 3, 3)
        self._lengths = np.array([d.lengths_m for d in digits]).reshape(-1, 3)
        self._radii = np.array([d.radii_m for d in digits]).reshape(-1, 4)
        self._loose = rest[loose].reshape(-1, 3) - centre
        kind = np.minimum(rows, 1)
        self.usual, self.spread = np.array(_USUAL)[kind].ravel(), np.array(_SPREAD)[kind].ravel()
        self.least, self.most = np.array(_LEAST)[kind].ravel(), np.array(_MOST)[kind].ravel()
        self.shares = _shares(rows)
        self.person = _people(rows, len(loose), groups)
        # What is usual as linear rows (r, size) with targets and variances: angles, couplings.
        last = 6 + 4 * np.flatnonzero(rows > 0) + 3
        count = self.angles + len(last)
        self.rows = np.zeros((count, self.size))
        self.rows[np.arange(self.angles), 6 + np.arange(self.angles)] = 1.0
        below = np.arange(self.angles, count)
        self.rows[below, last], self.rows[below, last - 1] = 1.0, -_COUPLING
        self.targets = np.concatenate([self.usual, np.zeros(len(last))])
        self.variances = np.concatenate([self.spread, np.full(len(last), _COUPLING_SIGMA)]) ** 2

    def project(
        self, postures: Array, rotations: Array, sides: Array, facing: Array
    ) -> tuple[Array, Array]:
        """Pixels (k, n, 2) of the dots, and their derivatives (k, n, 2, size).

        postures (k, size or more); rotations (k, 3, 3), camera from hand; sides (k,): 1 of a right
        hand, -1 of a left one; facing (k, fingers), rad.
        """
        points, slopes = self.place(postures, rotations, sides, facing)
        depth = np.maximum(points[..., 2], _NEAREST_M)[..., None]
        over = points[..., :2] / depth
        pixels = self.focal_px * over + self.middle_px
        flat = slopes[..., :2, :] - over[..., None] * slopes[..., 2:3, :]
        return pixels, self.focal_px / depth[..., None] * flat

    def place(
        self, postures: Array, rotations: Array, sides: Array, facing: Array
    ) -> tuple[Array, Array]:
        """Places (k, n, 3) of the dots in the camera's frame, m, and derivatives (.., size)."""
        points, slopes = self._in_hand(postures, facing)
        frames = mirrored(rotations, sides)
        points, slopes = points @ frames.swapaxes(1, 2), frames[:, None] @ slopes
        slopes[..., :3] = np.eye(3)
        # A turn w shifts a point p by w x p.
        for axis in range(3):
            slopes[..., 3 + axis] = cross(np.eye(3)[axis], points)
        return points + postures[:, None, :3], slopes

    def facing(self, postures: Array, rotations: Array, sides: Array) -> Array:
        """Where the camera is about each finger's bones (k, fingers), rad: 0 at their back."""
        chains = self._chains(postures)
        frames = mirrored(rotations, sides)[:, None]
        # Towards the camera, in the axes of the hand.
        middles = chains.joints.mean(axis=2)
        sight = -(middles @ frames[:, 0].swapaxes(1, 2) + postures[:, None, :3])
        sight = (sight[:, :, None] @ frames)[:, :, 0]  # (k, fingers, 3)
        seen = np.einsum("kfi,kfjix->kfx", sight, chains.skins)
        return np.asarray(np.arctan2(seen[..., 0], seen[..., 1]))

    def showing(self, postures: Array, rotations: Array, sides: Array, facing: Array) -> Array:
        """How far each dot is turned to the camera (k, n): 1 faces it, below 0 it faces away.

        Dots that are on no finger have 1.
        """
        chains, frames = self._chains(postures), mirrored(rotations, sides)
        cosine, sine = np.cos(facing)[:, :, None, None], np.sin(facing)[:, :, None, None]
        skin = (cosine * chains.skins[..., 1] + sine * chains.skins[..., 0]).reshape(
            len(postures), -1, 3
        ) @ frames.swapaxes(1, 2)
        places = chains.joints.reshape(len(postures), -1, 3) @ frames.swapaxes(1, 2)
        sight = -(places + postures[:, None, :3])
        turned_to = np.einsum("kdx,kdx->kd", skin, sight) / np.linalg.norm(sight, axis=2)
        loose = np.ones((len(postures), len(self._loose)))
        return np.concatenate([turned_to, loose], axis=1)[:, self._points]

    def _chains(self, postures: Array) -> _Chains:
        """Joints of the fingers in the hand's frame about its middle, and what turns them."""
        count, fingers = len(postures), self.fingers
        angles = postures[:, 6 : self.moving].reshape(count, fingers, 4)
        logs = postures[:, self.moving : self._roots].reshape(count, fingers, 3)
        shifts = postures[:, self._roots : self._ups].reshape(count, -1, 3)
        joints = np.zeros((count, fingers, 4, 3))
        skins = np.zeros((count, fingers, 4, 3, 3))
        cosines, sines = np.cos(angles), np.sin(angles)
        turn = self._turns @ about_y(cosines[..., 0], sines[..., 0])
        joints[:, :, 0] = at = self._bases + shifts[:, :fingers]
        axes = [(np.broadcast_to(self._turns[:, :, 1], at.shape), at)]
        bones = []
        for k in range(3):
            axes.append((-turn[..., 0], at))
            half = 0.5 * angles[..., k + 1]
            skins[:, :, k] = turn @ about_minus_x(np.cos(half), np.sin(half))
            turn = turn @ about_minus_x(cosines[..., k + 1], sines[..., k + 1])
            lengths = self._lengths[:, k] * np.exp(logs[..., k])
            bones.append(-lengths[..., None] * turn[..., 2])
            joints[:, :, k + 1] = at = at + bones[-1]
        skins[:, :, 3] = turn
        return _Chains(joints, skins, axes, bones)

    def _to_skin(self, postures: Array, skins: Array, facing: Array) -> tuple[Array, Array, Array]:
        """Of each joint's dot (k, f, 4, 3) m: a radius up, one aside, and where it is beside it."""
        cosine, sine = np.cos(facing)[:, :, None, None], np.sin(facing)[:, :, None, None]
        radii = self._radii[:, :, None]
        up = radii * (cosine * skins[..., 1] + sine * skins[..., 0])
        aside = radii * (cosine * skins[..., 0] - sine * skins[..., 1])
        shares = postures[:, self._ups : self.size].reshape(len(postures), -1, 2)[:, self._group]
        offsets = (_UP + shares[:, :, None, :1]) * up + shares[:, :, None, 1:] * aside
        offsets[:, :, 3] += _BEFORE_END * self._radii[:, 3:] * skins[:, :, 3, :, 2]
        return up, aside, offsets

    def _in_hand(self, postures: Array, facing: Array) -> tuple[Array, Array]:
        """Dots and derivatives by angles, lengths and shifts alone, about the hand's middle."""
        count, own, fingers = len(postures), self._roots, self.fingers
        joints, skins, axes, bones = self._chains(postures)
        slopes = np.zeros((count, fingers, 4, 3, self.size))
        up, aside, offsets = self._to_skin(postures, skins, facing)
        dots = joints + offsets
        each = np.arange(fingers)
        for j in range(4):
            for k in range(j):
                slopes[:, each, j, :, self.moving + 3 * each + k] = bones[k].swapaxes(0, 1)
            for k in range(j + 1):
                axis, start = axes[k]
                turning = cross(axis, dots[:, :, j] - start).swapaxes(0, 1)
                slopes[:, each, j, :, 6 + 4 * each + k] = turning
            if j < 3:
                # Skin over a joint goes half way with the bone beyond it.
                turning = 0.5 * cross(axes[j + 1][0], offsets[:, :, j]).swapaxes(0, 1)
                slopes[:, each, j, :, 6 + 4 * each + j + 1] = turning
            for k in range(3):
                slopes[:, each, j, k, own + 3 * each + k] = 1.0
            slopes[:, each, j, :, self._ups + 2 * self._group] = up[:, :, j].swapaxes(0, 1)
            slopes[:, each, j, :, self._ups + 2 * self._group + 1] = aside[:, :, j].swapaxes(0, 1)
        loose = self._loose + postures[:, own + 3 * fingers : self._ups].reshape(count, -1, 3)
        bare = np.zeros((count, loose.shape[1], 3, self.size))
        for number in range(loose.shape[1]):
            first = own + 3 * (fingers + number)
            bare[:, number, :, first : first + 3] = np.eye(3)
        points = np.concatenate([dots.reshape(count, -1, 3), loose], axis=1)
        every = np.concatenate([slopes.reshape(count, -1, 3, self.size), bare], axis=1)
        return points[:, self._points], every[:, self._points]


def _people(rows: npt.NDArray[np.int64], loose: int, groups: int) -> Array:
    """How people differ in what does not move of a posture, sigmas."""
    roots = np.where(rows == 0, _LOOSE_SIGMA, _ROOT_SIGMA)
    return np.concatenate(
        [
            np.full(3 * len(rows), _LENGTH_SIGMA),
            np.repeat(roots, 3),
            np.full(3 * loose, _LOOSE_SIGMA),
            np.tile([_UP_SIGMA, _ASIDE_SIGMA], groups),
        ]
    )


def _shares(rows: npt.NDArray[np.int64]) -> Array:
    """Covariance (angles, angles) of accelerations, one that is sharp having about 1."""
    flexion = np.tile([0.0, 1.0, 1.0, 0.8], len(rows))
    finger = np.repeat(np.eye(len(rows)), 4, axis=0)
    columns = np.concatenate(
        [
            np.diag(np.where(flexion > 0.0, _OWN, _SPLAY)),
            _FINGER * flexion[:, None] * finger,
            (_ALL * flexion * np.where(np.repeat(rows == 0, 4), 0.5, 1.0))[:, None],
        ],
        axis=1,
    )
    return np.asarray(columns @ columns.T)
