"""A chain of tapered limbs as a distance field: how far each pixel is from the skin, how far along
the chain, and on which side. All in mm of the finger's frame; vectorised over a box of pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.view import Picture

Box = tuple[slice, slice]
# How far beyond its skin a limb is computed, mm: as far as flesh rounds a joint.
MARGIN_MM = 3.0
_FAR_MM = 50.0


class Pixels(NamedTuple):
    """What the pixels see of the hand's plane, in the finger's frame; (h, w) each, mm."""

    x: Picture
    y: Picture
    size: Picture
    px_of: Callable[[Array], Array]  # points (n, 2) of the finger's frame -> px, lens included

    def box(self, points: Array, margin_mm: float) -> Box | None:
        """The pixels about points (n, 2) of the finger's frame; None if none is in the picture."""
        spread = np.array([(a, b) for a in (-1, 1) for b in (-1, 1)]) * margin_mm
        corners = self.px_of((points[:, None] + spread).reshape(-1, 2))
        limit = (self.x.shape[1], self.x.shape[0])
        low = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, limit)
        high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1, 0, limit)
        if (high - low).min() < 3:
            return None
        return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


class Limb(NamedTuple):
    """joints (k + 1, 2), radii (k + 1,). waist: how much thinner a bone's middle is than its
    ends; pad: how much thicker on the palm's side; blend: over what length flesh rounds a joint.
    """

    joints: Array
    radii: Array
    waist: float = 0.6
    pad: float = 1.2
    blend: float = 3.0


class Field(NamedTuple):
    """Per pixel, (h, w) each. distance: to the skin, negative inside; along: mm from the first
    joint; across: mm from the bones, positive towards the palm; radius: half the thickness there;
    fold: 0..1 where two bones that are no neighbours press together.
    """

    distance: Picture
    along: Picture
    across: Picture
    radius: Picture
    fold: Picture


def field_of(limb: Limb, pixels: Pixels, box: Box) -> Field:
    """The field in a box of pixels, which should be the limb's and MARGIN_MM about it."""
    shape = pixels.x[box].shape
    field = Field(
        np.full(shape, _FAR_MM, np.float32), *(np.zeros(shape, np.float32) for _ in range(4))
    )
    field.radius[:] = np.float32(limb.radii[0])
    start, top, left = 0.0, box[0].start, box[1].start
    bones: list[tuple[Box, Picture]] = []
    for joints, radii in zip(_pairs(limb.joints), _pairs(limb.radii), strict=True):
        length = float(np.hypot(*(joints[1] - joints[0])))
        near = pixels.box(joints, float(max(radii)) + MARGIN_MM)
        if near is not None:
            inner = (
                slice(near[0].start - top, near[0].stop - top),
                slice(near[1].start - left, near[1].stop - left),
            )
            bone = _bone(limb, joints, radii, pixels.x[near], pixels.y[near])
            bone.along[:] += np.float32(start)
            _unite(Field(*(plane[inner] for plane in field)), bone, np.float32(limb.blend))
            distance = np.full(shape, _FAR_MM, np.float32)
            distance[inner] = bone.distance
            bones.append((inner, distance))
        start += length
    for (inner, distance), (_, before) in zip(bones[2:], bones, strict=False):
        gap = distance[inner] - before[inner]
        inside = np.maximum(distance[inner], before[inner]) < 0.5
        np.maximum(
            field.fold[inner], np.exp(np.float32(-0.8) * gap * gap) * inside, out=field.fold[inner]
        )
    return field


def _pairs(of: Array) -> list[Array]:
    """Each with the next."""
    return [of[at : at + 2] for at in range(len(of) - 1)]


def _bone(limb: Limb, joints: Array, radii: Array, x: Picture, y: Picture) -> Field:
    """One tapered bone by itself."""
    length = float(np.hypot(*(joints[1] - joints[0])))
    ux, uy = ((joints[1] - joints[0]) / length).astype(np.float32)
    dx, dy = x - np.float32(joints[0, 0]), y - np.float32(joints[0, 1])
    along, across = dx * ux + dy * uy, dy * ux - dx * uy
    share = np.clip(along * np.float32(1.0 / length), 0.0, 1.0)
    radius = np.float32(radii[0]) + np.float32(radii[1] - radii[0]) * share
    if limb.pad or limb.waist:
        palmar = np.clip(across * np.float32(limb.pad / radii[0]), 0.0, limb.pad)
        radius += np.float32(4.0) * share * (1.0 - share) * (palmar - np.float32(limb.waist))
    beside = along - share * np.float32(length)
    distance = np.sqrt(beside * beside + across * across) - radius
    return Field(distance, along, across, radius, np.zeros((0, 0), np.float32))


def _unite(whole: Field, bone: Field, blend: np.float32) -> None:
    """Adds a bone: a polynomial smooth minimum rounds where flesh meets flesh. In place."""
    nearer = bone.distance < whole.distance
    for plane, other in ((1, bone.along), (2, bone.across), (3, bone.radius)):
        np.copyto(whole[plane], other, where=nearer)
    gap = whole.distance - bone.distance
    mix = np.clip(np.float32(0.5) - np.float32(0.5) / blend * gap, 0.0, 1.0)
    whole.distance[:] = bone.distance + gap * mix - blend * mix * (1.0 - mix)
