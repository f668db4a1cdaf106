"""Paint and skin as colours of vertices, and where the middle of the paint is. Pure.

A tip is painted all round from its end on, with a ragged edge; the wrist has a dab on the palm's
side. The truth of a tip is the point of its bone's axis in the middle of its paint's length, that
of the dab the skin under its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from testing.second_renderer.motion import Array
from testing.second_renderer.skin import PALM, Mesh, bone_frames

LANDMARKS = ("wrist", "thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip")
COLORS = ("violet", "magenta", "blue", "cyan", "green", "lime")
# Linear albedos of poster paints.
PAINTS = {
    "violet": (0.27, 0.08, 0.58),
    "magenta": (0.68, 0.03, 0.32),
    "blue": (0.03, 0.13, 0.62),
    "cyan": (0.02, 0.44, 0.55),
    "green": (0.02, 0.42, 0.12),
    "lime": (0.42, 0.70, 0.04),
}
# So many vertices tell the skin's height under the dab.
_ABOUT_DAB = 40


@dataclass(frozen=True)
class Job:
    """How a hand is painted: lengths of tips between these, raggedness of their edges (mm), the
    dab's radius and how far off the middle it is (mm), how unevenly paint covers (0..1).
    """

    length_mm: tuple[float, float] = (12.0, 16.0)
    ragged_mm: float = 0.8
    dab_mm: float = 8.0
    dab_off_mm: float = 2.0
    patchy: float = 0.15
    skin: tuple[float, float, float] = (0.50, 0.27, 0.19)
    sleeve: tuple[float, float, float] = (0.10, 0.11, 0.14)
    seed: int = 1


class Painted(NamedTuple):
    """Colours of vertices, which landmark each belongs to, and the landmarks in bones' frames."""

    albedo: Array  # (v, 3) linear
    share: Array  # (v, 6) of each landmark's paint
    bones: np.ndarray  # (6,)
    points: Array  # (6, 3) in the bone's frame


def painted(mesh: Mesh, job: Job) -> Painted:
    """A mesh with skin and paint."""
    rng = np.random.default_rng([job.seed, 5])
    bones = np.array([PALM, *(3 + 3 * digit for digit in range(5))])
    points, share = np.zeros((6, 3)), np.zeros((len(mesh.vertices), 6))
    for row in range(1, 6):
        bone = bones[row]
        local = (mesh.vertices - mesh.origins[bone]) @ mesh.frames[bone]
        length = 1e-3 * rng.uniform(*job.length_mm)
        around = np.arctan2(local[:, 1], local[:, 0])
        waves = sum(
            rng.uniform(-1, 1) * np.sin(k * around + rng.uniform(0, 6.3)) / np.sqrt(k)
            for k in (1, 2, 3, 5)
        )
        from_end = local[:, 2] + mesh.lengths[bone]
        inside = length + 1e-3 * job.ragged_mm * waves - from_end
        own = mesh.weights[:, bone - 2 : bone + 1].sum(axis=1) > 0.5
        share[:, row] = np.where(own, np.clip(0.5 + inside / 6e-4, 0.0, 1.0), 0.0)
        points[row] = (0.0, 0.0, -(mesh.lengths[bone] - 0.5 * length))
    points[0], share[:, 0] = _dab(mesh, job, rng)
    albedo = _skin(mesh, job, rng)
    cover = 1.0 - job.patchy * _noise(mesh.vertices, 0.004, rng).clip(0.0, 1.0)
    for row, color in enumerate(COLORS):
        amount = (share[:, row] * cover)[:, None]
        albedo = albedo * (1.0 - amount) + amount * np.array(PAINTS[color])
    return Painted(albedo, share, bones, points)


def _dab(mesh: Mesh, job: Job, rng: np.random.Generator) -> tuple[Array, Array]:
    angle = rng.uniform(0.0, 2.0 * np.pi)
    x, z = 1e-3 * job.dab_off_mm * np.array([np.cos(angle), np.sin(angle)])
    palm_side = (mesh.normals[:, 1] < -0.3) & (mesh.weights[:, PALM] > 0.9)
    near = np.hypot(mesh.vertices[:, 0] - x, mesh.vertices[:, 2] - z)
    around = np.argsort(np.where(palm_side, near, 1.0))[:_ABOUT_DAB]
    # The skin's height about there, as a polynomial of second order.
    dx, height, dz = (mesh.vertices[around] - [x, 0.0, z]).T
    terms = np.stack([np.ones_like(dx), dx, dz, dx * dx, dx * dz, dz * dz], axis=1)
    middle = np.array([x, np.linalg.lstsq(terms, height, rcond=None)[0][0], z])
    away = np.linalg.norm(mesh.vertices - middle, axis=1)
    turn = np.arctan2(mesh.vertices[:, 2] - middle[2], mesh.vertices[:, 0] - middle[0])
    waves = np.sin(2 * turn + rng.uniform(0, 6)) + 0.7 * np.sin(3 * turn + rng.uniform(0, 6))
    inside = 1e-3 * (job.dab_mm + 0.6 * job.ragged_mm * waves) - away
    return middle, np.clip(0.5 + inside / 6e-4, 0.0, 1.0)


def _skin(mesh: Mesh, job: Job, rng: np.random.Generator) -> Array:
    coarse, fine = _noise(mesh.vertices, 0.012, rng), _noise(mesh.vertices, 0.003, rng)
    albedo = np.array(job.skin) * (1.0 + 0.10 * coarse + 0.06 * fine)[:, None]
    # Palms and knuckles are redder here and there.
    albedo[:, 0] *= 1.0 + 0.05 * _noise(mesh.vertices, 0.008, rng)
    # A sleeve from some way behind the wrist on.
    cloth = np.clip((mesh.vertices[:, 2] - 0.055) / 0.002, 0.0, 1.0)[:, None]
    return np.asarray(albedo * (1.0 - cloth) + cloth * np.array(job.sleeve))


def _noise(points: Array, size_m: float, rng: np.random.Generator) -> Array:
    """Smooth noise of unit variance over points (p, 3): a sum of waves."""
    total = np.zeros(len(points))
    for _ in range(24):
        wave = rng.normal(0.0, 1.0 / size_m, 3)
        total += np.sin(points @ wave + rng.uniform(0.0, 2.0 * np.pi))
    return np.asarray(total / np.sqrt(12.0))


def landmarks_at(paint: Painted, wrist: Array, axes: Array, joints: Array) -> Array:
    """Where the middles of the paint are (6, 3) with the bones there."""
    origins, frames = bone_frames(wrist, axes, joints)
    at = [
        origins[bone] + frames[bone] @ point
        for bone, point in zip(paint.bones.tolist(), paint.points, strict=True)
    ]
    return np.array(at)
