"""Dots of one colour on moving hands, without a picture: masks as a search of colours finds them.

Joints of real recordings (or any others) through a camera of any direction. Fingers and palm hide
dots, dots that touch run into one blob, some are not found, some that are found are none. Pure.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from services.pi_tracker.image.blob import Blob, blobs_of_contours, external_contours
from services.simulator.recorded_motion.recording import RecordedJoints

Mask = npt.NDArray[np.uint8]
# Radii of fingers and thumb, m, and of a dot.
_FINGER_M, _THUMB_M = 0.0075, 0.009


@dataclass(frozen=True)
class DotScene:
    """What is filmed and how; all chances are a frame's."""

    joints_m: Array  # (n, 5, 4, 3) chains of thumb to little finger, camera frame, z forward
    dots: tuple[tuple[int, int], ...]  # (digit, joint) of each dot
    focal_px: float
    size_px: tuple[int, int]
    dot_m: float = 0.004  # radius
    jitter_px: float = 0.5  # sigma of each dot on its skin
    missed: float = 0.01  # chance of a dot not to be found
    hidden: float = 0.002  # chance to be hidden from now on, for 3 to 15 frames
    false_blobs: float = 0.02  # chance of a false blob to appear, for 1 to 40 frames
    hides: bool = True  # whether fingers hide dots


@dataclass(frozen=True, eq=False)
class DotFrame:
    """One frame: blobs, and where each dot is (d, 2) px and how much of it shows (d,), 0..1."""

    blobs: list[Blob]
    places: Array
    visible: Array
    radius: float  # mean radius of a dot, px


def dot_frames(scene: DotScene, seed: int) -> list[DotFrame]:
    """Every frame of a scene."""
    random = np.random.default_rng(seed)
    count = len(scene.dots)
    hidden = np.zeros(count, np.int64)
    false: list[list[float]] = []  # x, y, vx, vy, radius, frames left
    frames = []
    for joints in scene.joints_m:
        places, radii = project(scene, joints)
        places = places + random.normal(0.0, scene.jitter_px, places.shape)
        starts = random.random(count) < scene.hidden
        hidden = np.where(starts, random.integers(3, 16, count), np.maximum(hidden - 1, 0))
        drawn = (hidden == 0) & (random.random(count) >= scene.missed)
        mask, visible = _painted(scene, joints, places, radii, drawn)
        false = _moved(false, scene, places, radii, random)
        for x, y, _, _, radius, _ in false:
            cv2.circle(mask, (round(x / 2), round(y / 2)), max(round(radius / 2), 1), 1, -1)
        blobs = blobs_of_contours(external_contours(mask), mask, 0, (0, 0), 3)
        frames.append(DotFrame(blobs, places, visible, float(radii.mean())))
    return frames


def project(scene: DotScene, joints: Array) -> tuple[Array, Array]:
    """Pixels (d, 2) and radii px (d,) of the dots of one frame's joints (5, 4, 3)."""
    points = joints[tuple(np.array(scene.dots).T)]
    middle = 0.5 * (np.array(scene.size_px) - 1.0)
    pixels = scene.focal_px * points[:, :2] / points[:, 2:] + middle
    return pixels, scene.focal_px * scene.dot_m / points[:, 2]


def _moved(
    false: list[list[float]],
    scene: DotScene,
    places: Array,
    radii: Array,
    random: np.random.Generator,
) -> list[list[float]]:
    if random.random() < scene.false_blobs:
        centre = places.mean(axis=0) + random.normal(0.0, 1.0, 2) * (places.std(axis=0) * 1.5 + 10)
        velocity = random.normal(0.0, 1.0, 2) * random.choice([0.0, 4.0])
        radius = float(radii.mean()) * random.uniform(0.5, 1.2)
        false = [*false, [*centre, *velocity, radius, float(random.integers(1, 41))]]
    return [
        [x + vx, y + vy, vx, vy, radius, left - 1.0]
        for x, y, vx, vy, radius, left in false
        if left > 0.0
    ]


def _painted(
    scene: DotScene,
    joints: Array,
    places: Array,
    radii: Array,
    drawn: npt.NDArray[np.bool_],
) -> tuple[Mask, Array]:
    """The mask in cells, and the share of each dot that shows: the far first, the near over it."""
    width, height = scene.size_px[0] // 2, scene.size_px[1] // 2
    labels = np.zeros((height, width), np.uint8)
    half = 0.25 * (np.array(scene.size_px) - 1.0)
    cells = 0.5 * scene.focal_px * joints[..., :2] / joints[..., 2:] + half  # (5, 4, 2)
    order: list[tuple[float, int, int, int]] = []
    if scene.hides:
        order += [
            (float(joints[d, j : j + 2, 2].mean()), 0, d, j) for d in range(5) for j in range(3)
        ]
        order.append((float(joints[1:, 0, 2].mean()), 2, 0, 0))
    for number, (digit, joint) in enumerate(scene.dots):
        order.append((float(joints[digit, joint, 2]) - 0.011, 1, number, 0))
    whole = np.zeros(len(scene.dots))
    for _, kind, a, b in sorted(order, reverse=True):
        if kind == 0:
            radius = _THUMB_M if a == 0 else _FINGER_M
            thick = scene.focal_px * radius / float(joints[a, b, 2])  # diameter in cells
            ends = [tuple(np.round(cells[a, b + k]).astype(int).tolist()) for k in (0, 1)]
            cv2.line(labels, ends[0], ends[1], 0, max(round(thick), 1))
        elif kind == 2:
            palm = np.concatenate([cells[1:, 0], cells[:1, 0]]).round().astype(np.int32)
            cv2.fillConvexPoly(labels, cv2.convexHull(palm), 0)
        elif drawn[a]:
            centre = np.round(16 * (0.5 * places[a] - 0.25)).astype(int).tolist()
            radius_px = max(round(16 * 0.5 * float(radii[a])), 8)
            disc = np.zeros_like(labels)
            cv2.circle(disc, centre, radius_px, 1, -1, shift=4)
            whole[a] = max(np.count_nonzero(disc), np.pi * (0.5 * float(radii[a])) ** 2)
            labels[disc > 0] = a + 1
    counts = np.bincount(labels.ravel(), minlength=len(scene.dots) + 1)[1:]
    visible = np.where(drawn, counts / np.maximum(whole, 1.0), 0.0)
    return (labels > 0).astype(np.uint8), np.minimum(visible, 1.0)


def scene_of(
    recorded: RecordedJoints,
    dots: tuple[tuple[int, int], ...],
    size_px: tuple[int, int],
    fps: float,
    seed: int,
    count: int = 160,
) -> DotScene:
    """A recording to and fro in front of a camera that looks from a side where dots can be seen.

    In the first frame half of each dot shows or more, and of all nine tenths do.
    """
    random = np.random.default_rng(seed)
    while True:
        joints = _played(recorded, fps, count, random)
        scene = DotScene(joints, dots, 900.0, size_px)
        if _shown(scene, 0).min() < 0.5:
            continue
        if np.mean([_shown(scene, k) > 0.35 for k in range(0, count, 12)]) >= 0.9:
            return scene


def _shown(scene: DotScene, frame: int) -> Array:
    joints = scene.joints_m[frame]
    places, radii = project(scene, joints)
    inside = ((places > 5.0) & (places < np.array(scene.size_px) - 5.0)).all(axis=1)
    drawn = np.ones(len(scene.dots), bool)
    return np.asarray(_painted(scene, joints, places, radii, drawn)[1] * inside)


def _played(recorded: RecordedJoints, fps: float, count: int, random: np.random.Generator) -> Array:
    """Joints (count, 5, 4, 3) in the camera's frame: turned at random, and drifting."""
    last_s, times_s = float(recorded.times_s[-1]), np.arange(count) / fps
    phase = np.abs((times_s + random.uniform(0.0, 2.0 * last_s)) % (2.0 * last_s) - last_s)
    # Slows down at both ends.
    soft = 0.25
    phase = np.where(
        phase < soft,
        0.5 * soft + 0.5 * phase**2 / soft,
        np.where(
            phase > last_s - soft, last_s - 0.5 * soft - 0.5 * (last_s - phase) ** 2 / soft, phase
        ),
    )
    flat = recorded.joints_m.reshape(len(recorded.times_s), -1)
    columns = [np.interp(phase, recorded.times_s, flat[:, k]) for k in range(flat.shape[1])]
    joints = np.stack(columns, axis=1).reshape(count, 20, 3)
    joints = (joints - joints.mean(axis=(0, 1))) @ _turn(random.normal(size=3) * 2.0).T
    rates, phases = random.uniform(0.1, 0.6, 6), random.uniform(0.0, 2.0 * np.pi, 6)
    sizes = np.concatenate([random.uniform(0.01, 0.06, 3), random.uniform(0.1, 0.4, 3)])
    waves = sizes * np.sin(2.0 * np.pi * rates * times_s[:, None] + phases)
    waves[:, 2] += random.uniform(0.25, 0.6)
    moved = [own @ _turn(wave[3:]).T + wave[:3] for own, wave in zip(joints, waves, strict=True)]
    return np.stack(moved).reshape(count, 5, 4, 3)


def _turn(vector: Array) -> Array:
    """The rotation by a vector, rad; (3, 3)."""
    return np.asarray(cv2.Rodrigues(np.asarray(vector, np.float64))[0])
