"""Many spheres in the scene that share one mesh: each has a place, a size, a turn and a colour."""

from __future__ import annotations

import numpy as np
import viser

from rhot.geometry.transforms import Array
from services.viewer.scene.shapes import f32, unit_sphere

# viser wants a size of what is not there, too.
HIDDEN_M = 1e-6


def add_spheres(
    scene: viser.SceneApi, path: str, colors: np.ndarray, opacity: float | None = None
) -> viser.BatchedMeshHandle:
    """As many hidden spheres as colours, (n, 3) uint8."""
    count = len(colors)
    return scene.add_batched_meshes_simple(
        path,
        *unit_sphere(),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.zeros((count, 3)),
        batched_scales=np.full((count, 3), HIDDEN_M),
        batched_colors=colors,
        opacity=opacity,
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )


def place(handle: viser.BatchedMeshHandle, positions_m: Array, radii_m: Array) -> None:
    """Balls of radii (n,) at positions (n, 3)."""
    handle.batched_positions = f32(positions_m)
    handle.batched_scales = f32(np.repeat(radii_m[:, None], 3, axis=1))
