"""Touches in the scene: the finger tips that touch are lit, the points they touch are marked."""

from __future__ import annotations

import numpy as np
import viser

from rhot.hand import JOINT_INDEX, HandName
from rhot.messages.objects import HandPart
from services.viewer.live.palette import CONTACT, TOUCH
from services.viewer.live.views import View
from services.viewer.scene.spheres import HIDDEN_M, add_spheres, place, reveal

# Two hands with five tips and a palm each, as many as a message may hold for one object.
_SLOTS = 12
# A halo goes round the joint at a tip and is seen through, so that its colour stays.
_HALO_M, _HALO_OPACITY = 0.0095, 0.35
_PALM_HALO_M = 0.022
_MARK_M = 0.0042


def joint_of(part: HandPart) -> int:
    """The joint that is lit for a part of the hand."""
    return JOINT_INDEX["palm" if part == "palm" else f"{part}_tip"]


def touching(view: View, hand: HandName) -> frozenset[HandPart]:
    """The parts of a hand that touch something."""
    return frozenset(touch.part for touch in view.touches if touch.hand == hand)


class Touches:
    """Halos round tips that touch, marks on what they touch."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._halos = add_spheres(scene, "/touches/tips", _tiled(TOUCH), _HALO_OPACITY)
        self._marks = add_spheres(scene, "/touches/points", _tiled(CONTACT))

    def show(self, view: View) -> None:
        """Light what touches now; who is not in view, is not lit."""
        lit = {
            (touch.hand, touch.part): view.hands[touch.hand].positions_m[joint_of(touch.part)]
            for touch in view.touches
            if touch.hand in view.hands
        }
        radii = [_PALM_HALO_M if part == "palm" else _HALO_M for _, part in lit]
        _show(self._halos, list(lit.values()), radii)
        marks = [np.array(touch.point_m) for touch in view.touches]
        _show(self._marks, marks, [_MARK_M] * len(marks))


def _tiled(color: tuple[int, int, int]) -> np.ndarray:
    return np.tile(np.array(color, dtype=np.uint8), (_SLOTS, 1))


def _show(
    handle: viser.BatchedMeshHandle, positions_m: list[np.ndarray], radii_m: list[float]
) -> None:
    """Spheres at positions; the first of them where there are more than slots."""
    count = min(len(positions_m), _SLOTS)
    reveal(handle, count > 0)
    if not count:
        return
    where, radii = np.zeros((_SLOTS, 3)), np.full(_SLOTS, HIDDEN_M)
    where[:count], radii[:count] = positions_m[:count], radii_m[:count]
    place(handle, where, radii)
