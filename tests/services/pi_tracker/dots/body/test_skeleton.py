"""A hand as a camera sees its dots: rhot.hand's, its derivatives, a left hand, dots on the palm."""

from __future__ import annotations

import numpy as np

from rhot.hand import CHAIN_JOINTS, HANDS, JOINTS, default_hand, forward
from services.pi_tracker.dots.body.rotations import turned
from services.pi_tracker.dots.body.skeleton import Skeleton
from services.pi_tracker.dots.chains import finger_landmarks

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
    # Dots within the joints, but for the tips, which they are a little before.
    posture[-4::2] = -0.5
    angles = np.zeros((5, 4))
    angles[0], angles[3] = (0.2, 0.1, 0.4, 0.3), (-0.1, 0.5, 0.9, 0.6)
    posture[6:14] = angles[[0, 3]].ravel()
    rotation = turned(np.array([[0.3, -0.5, 1.2]]))
    for hand in HANDS:
        side = np.array([1.0 if hand == "right" else -1.0])
        found, _ = skeleton.place(posture[None], rotation, side, np.zeros((1, 2)))
        model = default_hand(hand)
        truth, turns = forward(model, rotation[0], np.zeros(3), angles)
        for row, digit in enumerate(model.digits):
            tip = CHAIN_JOINTS[row, 3]
            truth[tip] += 0.5 * digit.radii_m[3] * turns[tip, :, 2]
        truth = truth[[JOINTS.index(name) for name in NAMES]]
        # The hand's middle is where the first picture puts it.
        assert np.allclose(np.ptp(found[0] - truth, axis=0), 0.0, atol=1e-9)


def test_derivatives_are_what_small_steps_do() -> None:
    skeleton = Skeleton(NAMES, SIZE)
    posture, side = _posture(skeleton, 3), np.array([-1.0])
    rotation = turned(np.array([[0.7, 0.2, -0.4]]))
    facing = np.array([[0.5, -1.2]])
    pixels, slopes = skeleton.project(posture[None], rotation, side, facing)
    for number in range(skeleton.size):
        step = np.zeros((1, skeleton.size))
        step[0, number] = 1e-6
        moved, _ = skeleton.project(posture + step, turned(step[:, 3:6]) @ rotation, side, facing)
        assert np.allclose((moved - pixels) / 1e-6, slopes[..., number], atol=0.05)


def test_dots_are_on_the_side_that_the_camera_sees_and_face_away_once_the_hand_turns() -> None:
    skeleton = Skeleton(NAMES, SIZE)
    posture, side = np.zeros((1, skeleton.size)), np.ones(1)
    posture[0, 2] = 0.4
    # The palm, then the back, towards the camera.
    for rotation in (turned(np.array([[-0.5 * np.pi, 0.0, 0.0]])), turned(np.array([[1.4, 0, 0]]))):
        facing = skeleton.facing(posture, rotation, side)
        places, _ = skeleton.place(posture, rotation, side, facing)
        bare = posture.copy()
        bare[0, -4::2] = -0.5
        joints, _ = skeleton.place(bare, rotation, side, facing)
        fingers = [n for n, name in enumerate(NAMES) if "ring" in name or "thumb" in name]
        assert np.all(places[0, fingers, 2] < joints[0, fingers, 2] - 1e-3)
        shown = skeleton.showing(posture, rotation, side, facing)[0]
        assert shown.min() > 0.5
        assert shown[0] == 1.0
        over = turned(np.array([[0.0, np.pi, 0.0]])) @ rotation
        assert skeleton.showing(posture, over, side, facing)[0, fingers].max() < 0.0
