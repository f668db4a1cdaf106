"""A chain of tapered limbs as a distance field: how far each pixel is from the skin, how far along
the chain, and on which side. All in mm of the finger's frame; vectorised over a box of pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.view import Picture


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


def field_of(limb: Limb, x: Picture, y: Picture) -> Field:
    """The field at pixels whose coordinates in the finger's frame are x, y (h, w)."""
    start = 0.0
    parts = []
    for here, there, r_here, r_there in zip(
        limb.joints[:-1], limb.joints[1:], limb.radii[:-1], limb.radii[1:], strict=True
    ):
        length = float(np.hypot(*(there - here)))
        ux, uy = ((there - here) / length).astype(np.float32)
        dx, dy = x - np.float32(here[0]), y - np.float32(here[1])
        along, across = dx * ux + dy * uy, dy * ux - dx * uy
        share = np.clip(along * np.float32(1.0 / length), 0.0, 1.0)
        belly = 4.0 * share * (1.0 - share)
        radius = np.float32(r_here) + np.float32(r_there - r_here) * share
        palmar = np.clip(across * np.float32(1.0 / r_here), 0.0, 1.0)
        radius += belly * (np.float32(limb.pad) * palmar - np.float32(limb.waist))
        beside = along - share * np.float32(length)
        distance = np.sqrt(beside * beside + across * across) - radius
        parts.append((distance, along + np.float32(start), across, radius))
        start += length
    return _united(parts, np.float32(limb.blend))


def _united(parts: list[tuple[Picture, Picture, Picture, Picture]], blend: np.float32) -> Field:
    """One skin about all bones: a polynomial smooth minimum of neighbours."""
    distance, along, across, radius = parts[0]
    fold = np.zeros_like(distance)
    for number, (other, *rest) in enumerate(parts[1:], start=1):
        nearer = other < distance
        if number >= 2:
            gap = other - parts[number - 2][0]
            inside = np.maximum(other, parts[number - 2][0]) < 0.5
            fold = np.maximum(fold, np.exp(-gap * gap * np.float32(0.8)) * inside)
        mix = np.clip(0.5 + 0.5 * (other - distance) / blend, 0.0, 1.0)
        distance = other + (distance - other) * mix - blend * mix * (1.0 - mix)
        along = np.where(nearer, rest[0], along)
        across = np.where(nearer, rest[1], across)
        radius = np.where(nearer, rest[2], radius)
    return Field(distance, along, across, radius, fold)
