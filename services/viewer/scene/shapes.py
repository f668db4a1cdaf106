"""Meshes and skeleton geometry of the live view. Pure.

A unit mesh is drawn many times, each with a position, an orientation and a scale. Degenerate bones
get no length, never NaN.
"""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array
from rhot.hand import CHAIN_JOINTS, JOINT_INDEX
from services.viewer.live.palette import Rgb

# A normal error in three dimensions is within so many standard deviations 95 % of the time:
# sqrt(chi2.ppf(0.95, 3)).
_SIGMAS = 2.7955
# What is as uncertain as this says nothing of where it is; a browser is sent no size of zero.
_MAX_AXIS_M, _MIN_AXIS_M = 0.1, 1e-6
_MAX_M2 = 1.0
# xx, xy, xz, yy, yz, zz as the rows of a matrix.
_SYMMETRIC = [0, 1, 2, 1, 3, 4, 2, 4, 5]

Faces = npt.NDArray[np.uint32]


def _bones() -> npt.NDArray[np.intp]:
    """Joint index pairs: wrist to every metacarpal, along each digit, and across the knuckles for
    the palm.
    """
    wrist = JOINT_INDEX["wrist"]
    pairs = []
    for row, chain in enumerate(CHAIN_JOINTS.tolist()):
        joints = chain if row == 0 else [chain[0] - 1, *chain]
        pairs += [(wrist, joints[0]), *itertools.pairwise(joints)]
    knuckles = CHAIN_JOINTS[1:, 0].tolist()
    return np.array([*pairs, *itertools.pairwise(knuckles)])


# (27, 2): 24 bones and 3 lines across the knuckles.
BONES = _bones()


def cylinders(start_m: Array, end_m: Array) -> tuple[Array, Array, Array]:
    """Middles (n, 3), orientations wxyz (n, 4) and lengths (n,) of cylinders from start to end.

    start and end (n, 3); the unit cylinder that they turn and scale lies along z.
    """
    along = end_m - start_m
    length = np.sqrt(np.sum(along**2, axis=1))
    z = np.where(length[:, None] > 1e-9, along / np.maximum(length, 1e-9)[:, None], [0.0, 0.0, 1.0])
    # The shortest rotation from +z to the bone u is (1 + z . u, z x u). It vanishes for a bone
    # along -z: half a turn about x instead.
    wxyz = np.stack([1.0 + z[:, 2], -z[:, 1], z[:, 0], np.zeros(len(z))], axis=1)
    norm = np.sqrt(np.sum(wxyz**2, axis=1))
    wxyz = np.where(
        norm[:, None] > 1e-6, wxyz / np.maximum(norm, 1e-6)[:, None], [0.0, 1.0, 0.0, 0.0]
    )
    return 0.5 * (start_m + end_m), wxyz, length


def ellipsoids(covariance_m2: Array) -> tuple[Array, Array]:
    """Orientations wxyz (n, 4) and half axes (n, 3) that 95 % of errors stay inside of.

    covariance_m2 (n, 6): xx, xy, xz, yy, yz, zz. Whatever came over the network: no NaN, and none
    larger than a hand.
    """
    bounded = np.clip(np.nan_to_num(covariance_m2, nan=_MAX_M2), -_MAX_M2, _MAX_M2)
    variances, axes = np.linalg.eigh(bounded[:, _SYMMETRIC].reshape(-1, 3, 3))
    # A mirrored triple of axes is no rotation; an axis turned round is the same ellipsoid's.
    axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
    wxyz = Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]
    return wxyz, np.clip(_SIGMAS * np.sqrt(np.maximum(variances, 0.0)), _MIN_AXIS_M, _MAX_AXIS_M)


def unit_sphere(rings: int = 10, segments: int = 16) -> tuple[Array, Faces]:
    """Vertices (n, 3) and faces (m, 3) of a sphere of radius 1, seen from outside."""
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    around = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    body = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1).reshape(
        -1, 3
    )
    top, bottom = len(body), len(body) + 1
    faces = _strips(rings - 1, segments)
    j = np.arange(segments)
    after = (j + 1) % segments
    last = (rings - 2) * segments
    caps = [
        np.stack([np.full(segments, top), j, after], axis=1),
        np.stack([np.full(segments, bottom), last + after, last + j], axis=1),
    ]
    return np.vstack([body, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]]), np.vstack([faces, *caps]).astype(
        np.uint32
    )


def unit_cylinder(segments: int = 12) -> tuple[Array, Faces]:
    """An open tube of radius 1 and length 1 along z about the origin.

    Joints' spheres cover its ends.
    """
    around = np.linspace(0.0, 2.0 * np.pi, segments, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(segments)], axis=1)
    half = np.array([0.0, 0.0, 0.5])
    return np.vstack([ring + half, ring - half]), _strips(2, segments).astype(np.uint32)


def _strips(rings: int, segments: int) -> npt.NDArray[np.intp]:
    """Faces between consecutive rings of vertices, the upper (+z) ring first."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    upper, right = i * segments + j, i * segments + (j + 1) % segments
    lower, lower_right = upper + segments, right + segments
    return np.concatenate(
        [
            np.stack([upper, lower, lower_right], -1).reshape(-1, 3),
            np.stack([upper, lower_right, right], -1).reshape(-1, 3),
        ]
    )


def fading_lines(trail_m: Array, faint: Rgb, strong: Rgb) -> tuple[Array, npt.NDArray[np.uint8]]:
    """Lines (s, 2, 3) along k trails (n, k, 3), oldest first; colours (s, 2, 3) fade."""
    lines_m = np.stack([trail_m[:-1], trail_m[1:]], axis=2).reshape(-1, 2, 3)
    share = np.linspace(0.0, 1.0, len(trail_m))[:, None]
    rgb = np.rint((1.0 - share) * faint + share * np.array(strong)).astype(np.uint8)  # (n, 3)
    colors = np.repeat(np.stack([rgb[:-1], rgb[1:]], axis=1), trail_m.shape[1], axis=0)
    return lines_m, colors


def f32(values: Array) -> npt.NDArray[np.float32]:
    """As float32, which is what goes to the browser."""
    return values.astype(np.float32)
