"""Many spheres in the scene that share one mesh, and how arrays are put into the scene."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
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


def put(handle: Any, **arrays: npt.NDArray[Any]) -> None:
    """Assign arrays of a handle, those that have changed.

    viser finds that out as well, but takes ten times as long to.
    """
    for name, array in arrays.items():
        if not np.array_equal(getattr(handle, name), array):
            setattr(handle, name, array)


def reveal(handle: viser.SceneNodeHandle, visible: bool) -> None:
    """Show or hide; the same as for `put`."""
    if handle.visible != visible:
        handle.visible = visible


def place(handle: viser.BatchedMeshHandle, positions_m: Array, radii_m: Array) -> None:
    """Balls of radii (n,) at positions (n, 3)."""
    scales = f32(np.repeat(radii_m[:, None], 3, axis=1))
    put(handle, batched_positions=f32(positions_m), batched_scales=scales)
