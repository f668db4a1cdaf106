"""Touches in the scene: the finger tips that touch are lit, the points they touch are marked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from rhot.geometry.transforms import Array
from rhot.hand import JOINT_INDEX
from rhot.messages.objects import HandPart
from services.viewer.live.model import View
from services.viewer.live.palette import CONTACT, TOUCH
from services.viewer.live.shapes import f32, unit_sphere

# Two hands with five tips and a palm each, as many as a message may hold for one object.
_SLOTS = 12
# A halo goes round the paint of a tip (8 mm) and is seen through, so that its colour stays.
_HALO_M, _HALO_OPACITY = 0.0135, 0.5
_PALM_HALO_M = 0.022
_MARK_M = 0.0055
# viser wants a size of what is not there, too.
_HIDDEN_M = 1e-6


def joint_of(part: HandPart) -> int:
    """The joint that is lit for a part of the hand."""
    return JOINT_INDEX["palm" if part == "palm" else f"{part}_tip"]


class Touches:
    """Halos round tips that touch, marks on what they touch."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._halos = _spheres(scene, "/touches/tips", TOUCH, _HALO_OPACITY)
        self._marks = _spheres(scene, "/touches/points", CONTACT, 1.0)

    def show(self, view: View) -> None:
        """Light what touches now; who is not in view, is not lit."""
        lit = {
            (touch.hand, touch.part): view.hands[touch.hand].positions_m[joint_of(touch.part)]
            for touch in view.touches
            if touch.hand in view.hands
        }
        radii = [_PALM_HALO_M if part == "palm" else _HALO_M for _, part in lit]
        _place(self._halos, list(lit.values()), radii)
        marks = [np.array(touch.point_m) for touch in view.touches]
        _place(self._marks, marks, [_MARK_M] * len(marks))


def _spheres(
    scene: viser.SceneApi, path: str, color: tuple[int, int, int], opacity: float
) -> viser.BatchedMeshHandle:
    return scene.add_batched_meshes_simple(
        path,
        *unit_sphere(),
        np.tile([1.0, 0.0, 0.0, 0.0], (_SLOTS, 1)),
        np.zeros((_SLOTS, 3)),
        batched_scales=np.full((_SLOTS, 3), _HIDDEN_M),
        batched_colors=np.tile(np.array(color, dtype=np.uint8), (_SLOTS, 1)),
        opacity=opacity if opacity < 1.0 else None,
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )


def _place(
    handle: viser.BatchedMeshHandle, positions_m: Sequence[Array], radii_m: Sequence[float]
) -> None:
    """Spheres at positions; the first of them where there are more than slots."""
    count = min(len(positions_m), _SLOTS)
    handle.visible = count > 0
    if not count:
        return
    where, radii = np.zeros((_SLOTS, 3)), np.full(_SLOTS, _HIDDEN_M)
    where[:count], radii[:count] = positions_m[:count], radii_m[:count]
    handle.batched_positions = f32(where)
    handle.batched_scales = f32(np.repeat(radii[:, None], 3, axis=1))
