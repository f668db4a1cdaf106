"""The arrays that the render kernels work on: one scene, one camera, one frame. Pure.

They are tuples of arrays, since compiled kernels take those as they are. A renderer makes them once
and overwrites the parts of a frame for each picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import Ints, ShapeArrays
from services.simulator.render.projection import Array32, lens_parameters
from services.simulator.render.ray_capsule import FAR
from services.simulator.scene.object_bodies import Meshes

# Samples a pixel at the outline of something still, and at most. Measured on a drifting finger tip:
# 4 samples move its centroid by 0.037 px RMS, 6 by under 0.015, 12 no less.
MIN_SAMPLES, MAX_SAMPLES = 6, 12
# Random arrangements tried for each number of samples.
_TRIES = 300


class FrameTiming(NamedTuple):
    """When each row is exposed, in u: -1 is the first instant of a frame, 1 the last."""

    first_row: float  # mid-exposure of row 0
    row_step: float  # from one row to the next
    exposure: float  # how long a row is exposed


class CameraView(NamedTuple):
    """Where a camera stands, and its lens."""

    rotation: Array  # (3, 3) camera from rig
    translation: Array  # (3,) m
    lens: Array  # (9,) or (8,) `projection.lens_parameters`


class Surfaces(NamedTuple):
    """How m surfaces look, and the light that falls on them: `materials.surfaces_in_light`."""

    materials: Array  # (m, 7)
    lights: Array  # (8, 3)
    texture: Array32  # (TEXELS, TEXELS)
    facets: Array  # (f, 3) normals of the meshes' triangles


class CapsulePaths(NamedTuple):
    """c capsules, and how they move during a frame: parabolas in u, coefficients first.

    motion_paths.py overwrites the last four for each frame.
    """

    frame: Ints  # (c, 2) which body frame either end is fixed to
    offset: Array  # (c, 2, 3) m, in that frame
    radius: Array  # (c, 2) m
    # (c, 4) surface, surface of the painted end or -1, whether dabs stick to it, which solid
    kind: Ints
    end_m: Array  # (c, 4) painted length, and how it leans: bodies.ShapeArrays
    half: Array  # (c, 2) m, of a box along its second and third axis
    ends: Array  # (c, 2, 3, 3) centres of both ends in the camera frame, m
    palms: Array  # (c, 3, 3) palmar direction of the first end's body frame
    tracks: Array  # (c, 2, 3, 3) x, y and radius of both ends in the picture, px
    rows: Ints  # (c, 2) first and last row that the capsule can touch


class DabPaths(NamedTuple):
    """d dabs of paint, and how they move during a frame."""

    frame: Ints  # (d,) which body frame it is fixed to
    offset: Array  # (d, 3) m, in that frame
    radius_squared: Array  # (d,) m^2
    surface: Ints  # (d,)
    paths: Array  # (d, 3, 3) centres in the camera frame, m


class SceneArrays(NamedTuple):
    """All that there is to see."""

    capsules: CapsulePaths
    dabs: DabPaths
    surfaces: Surfaces
    meshes: Meshes


class FrameBuffers(NamedTuple):
    """One picture on its way, and what does not change from picture to picture.

    Where nothing was drawn depth is FAR, and capsule, label (1 + surface) and flags are 0.
    """

    rays: Array32  # (h, 3, w) unit vectors
    vignette: Array32  # (h, w) share of the light that arrives
    backdrop: Array32  # (h, w, 3) linear RGB
    patterns: Array  # (n, k, 3) `sample_patterns`
    depth: Array32  # (h, w) m along the ray
    capsule: npt.NDArray[np.int16]  # (h, w) which one is nearest
    label: npt.NDArray[np.int16]  # (h, w)
    flags: npt.NDArray[np.uint8]  # (h, w) 1 + px of motion where one ray is not enough
    columns: Ints  # (h, 2) first and last column that was touched, (w, -1) if none
    light: Array32  # (h, w, 3) linear RGB


def camera_view(camera: Camera) -> CameraView:
    """The view of a camera of the rig."""
    T = camera.T_camera_from_rig
    return CameraView(
        rotation=np.ascontiguousarray(T[:3, :3]),
        translation=np.ascontiguousarray(T[:3, 3]),
        lens=lens_parameters(camera),
    )


def capsule_paths(shapes: ShapeArrays) -> CapsulePaths:
    """The capsules of a scene, their paths still empty."""
    count = len(shapes.frame)
    return CapsulePaths(
        frame=shapes.frame,
        offset=shapes.offset,
        radius=shapes.radius,
        kind=shapes.kind,
        end_m=shapes.end_m,
        half=shapes.half,
        ends=np.empty((count, 2, 3, 3)),
        palms=np.empty((count, 3, 3)),
        tracks=np.empty((count, 2, 3, 3)),
        rows=np.empty((count, 2), np.int64),
    )


def dab_paths(shapes: ShapeArrays) -> DabPaths:
    """The dabs of a scene, their paths still empty."""
    return DabPaths(
        frame=shapes.dab_frame,
        offset=shapes.dab_offset,
        radius_squared=shapes.dab_radius**2,
        surface=shapes.dab_surface,
        paths=np.empty((len(shapes.dab_frame), 3, 3)),
    )


def frame_buffers(rays: Array32, vignette: Array32, backdrop: Array32) -> FrameBuffers:
    """Buffers of a camera that see nothing but the backdrop, vignetting included."""
    height, _, width = rays.shape
    return FrameBuffers(
        rays=rays,
        vignette=vignette,
        backdrop=backdrop,
        patterns=sample_patterns(),
        depth=np.full((height, width), FAR, np.float32),
        capsule=np.zeros((height, width), np.int16),
        label=np.zeros((height, width), np.int16),
        flags=np.zeros((height, width), np.uint8),
        columns=np.zeros((height, 2), np.int64),
        light=backdrop.copy(),
    )


def sample_patterns() -> Array:
    """Patterns of n samples: x and y from the pixel's middle in px, and rank in time 0..n-1.

    (MAX_SAMPLES + 1, MAX_SAMPLES, 3), of which [n, :n] is the pattern of n. Latin squares: each
    row, column and instant of a pixel divided n-fold is used once, so that the mean lies exactly in
    the middle (an uneven pattern would shift every outline). Of many arrangements the one is taken
    whose samples keep furthest apart.
    """
    rng = np.random.default_rng(1)
    table = np.zeros((MAX_SAMPLES + 1, MAX_SAMPLES, 3))
    for n in range(MIN_SAMPLES, MAX_SAMPLES + 1):
        in_order = np.tile(np.arange(n), (_TRIES, 1))  # (tries, n)
        shuffled = [rng.permuted(in_order, axis=1) for _ in ("y", "time")]
        tries = np.stack([in_order, *shuffled], 2)  # (tries, n, 3)
        apart = np.abs(tries[:, :, None] - tries[:, None, :])  # (tries, n, n, 3)
        # Patterns repeat from pixel to pixel: distances wrap round.
        apart = np.minimum(apart, n - apart)
        in_space = np.sum(apart[..., :2] ** 2, axis=3)
        in_space_and_time = np.sum(apart**2, axis=3)
        score = np.min((in_space + 0.5 * in_space_and_time) + 1e6 * np.eye(n), axis=(1, 2))
        best = tries[int(np.argmax(score))]
        table[n, :n, :2] = (best[:, :2] + 0.5) / n - 0.5
        table[n, :n, 2] = best[:, 2]
    return table
