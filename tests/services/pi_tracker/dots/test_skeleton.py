"""A hand as a camera sees its dots: rhot.hand's, its derivatives, a left hand, dots on the palm."""

from __future__ import annotations

import numpy as np

from rhot.hand import HANDS, JOINTS, default_hand, forward
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.skeleton import Skeleton, turned

NAMES = ("wrist", *finger_landmarks("ring"), "middle_metacarpal", *finger_landmarks("thumb"))
SIZE = (1280, 720)


def _posture(skeleton: Skeleton, seed: int) -> np.ndarray:
    posture = np.random.default_rng(seed).normal(0.0, 0.1, skeleton.size)
    posture[:6] = 0.02, -0.03, 0.45, 0.0, 0.0, 0.0
    return posture


def test_the_joints_are_those_of_the_one_hand() -> None:
    skeleton = Skeleton(NAMES, SIZE)
    posture = np.zeros(skeleton.size)
    posture[2] = 0.5
    angles = np.zeros((5, 4))
    angles[0], angles[3] = (0.2, 0.1, 0.4, 0.3), (-0.1, 0.5, 0.9, 0.6)
    posture[6:14] = angles[[0, 3]].ravel()
    rotation = turned(np.array([[0.3, -0.5, 1.2]]))
    for hand in HANDS:
        side = np.array([1.0 if hand == "right" else -1.0])
        found, _ = skeleton.place(posture[None], rotation, side)
        truth, _ = forward(default_hand(hand), rotation[0], np.zeros(3), angles)
        truth = truth[[JOINTS.index(name) for name in NAMES]]
        # The hand's middle is where the first picture puts it.
        assert np.allclose(np.ptp(found[0] - truth, axis=0), 0.0, atol=1e-9)


def test_derivatives_are_what_small_steps_do() -> None:
    skeleton = Skeleton(NAMES, SIZE)
    posture, side = _posture(skeleton, 3), np.array([-1.0])
    rotation = turned(np.array([[0.7, 0.2, -0.4]]))
    pixels, slopes = skeleton.project(posture[None], rotation, side)
    for number in range(skeleton.size):
        step = np.zeros((1, skeleton.size))
        step[0, number] = 1e-6
        moved, _ = skeleton.project(posture + step, turned(step[:, 3:6]) @ rotation, side)
        assert np.allclose((moved - pixels) / 1e-6, slopes[..., number], atol=0.05)
