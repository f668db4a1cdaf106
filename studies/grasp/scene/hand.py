"""A hand from the side, layer by layer from the back: other fingers, sleeve, palm, index, thumb."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.flesh import MARGIN_MM, Box, Field, Limb, Pixels, field_of
from studies.grasp.scene.skin import (
    Light,
    Wrinkles,
    cover,
    painted,
    shade,
    skin_albedo,
    textured,
)
from studies.grasp.scene.subjects import Subject, chain
from studies.grasp.scene.view import Picture

# Where the thumb's metacarpal begins, from the index finger's MCP joint, mm.
THUMB_BASE = (-56.0, 17.0)
# A dot on the back of the hand, on the base line.
BASE_DOT = (-42.0, 0.0)
_DOT_RADIUS_MM = 2.6
_SLEEVE = (0.42, 0.30, 0.24)
_NAIL = (0.70, 0.74, 0.90)
# The other fingers beside the index: joint of the knuckle (mm), bones against the index finger's,
# further flexion (rad), how dark they are in its shadow.
_OTHERS = (
    ((-9.0, 8.0), 0.86, 0.20, 0.55),
    ((-4.0, 5.0), 1.02, 0.14, 0.66),
    ((-1.0, 2.5), 1.08, 0.07, 0.76),
)


class Layer(NamedTuple):
    """Something to be laid over the picture in its box (rows, columns)."""

    box: Box
    colour: Picture  # (3, h, w)
    share: Picture  # (h, w)


class Look(NamedTuple):
    """How the hand is dressed: colour of the dots (None: plain skin), whether the thumb has some,
    the light, the seed of the skin's texture.
    """

    dots: tuple[float, float, float] | None
    thumb: bool
    light: Light
    seed: int


def layers(
    subject: Subject, angles: Array, thumb: Array, pixels: Pixels, look: Look
) -> Iterator[Layer]:
    """The hand for the index finger's angles (3,) and the thumb's (3,), from the back."""
    yield from _others(subject, angles, pixels, look)
    if not look.thumb:
        yield from _thumb(subject, thumb, pixels, look)
    yield from _palm(subject, pixels, look)
    yield from _index(subject, angles, pixels, look)
    if look.thumb:
        yield from _thumb(subject, thumb, pixels, look)


def _seen(limb: Limb, pixels: Pixels) -> tuple[Box, Field, Picture] | None:
    """A limb's box, its field and its silhouette there."""
    box = pixels.box(limb.joints, float(np.max(limb.radii)) + MARGIN_MM)
    if box is None:
        return None
    field = field_of(limb, pixels, box)
    return box, field, cover(field.distance, pixels.size[box])


def _others(subject: Subject, angles: Array, pixels: Pixels, look: Look) -> Iterator[Layer]:
    for start, length, more, dark in _OTHERS:
        bent = angles + more * np.array([0.6, 1.0, 0.5]) * (0.4 + angles[1])
        lengths = tuple(length * one for one in subject.lengths)
        limb = Limb(chain(lengths, bent, start), np.asarray(subject.radii) * (0.9 + 0.1 * length))
        seen = _seen(limb, pixels)
        if seen:
            box, field, share = seen
            colour = tuple(dark * one for one in subject.skin)
            wrinkles = Wrinkles(_ends(limb)[1:-1], tuple(bent[1:]), 0.7 * subject.crease)
            albedo = skin_albedo(field, colour, wrinkles, look.seed, 1)
            yield Layer(box, shade(field, albedo, look.light, 0.01), share)


def _palm(subject: Subject, pixels: Pixels, look: Look) -> Iterator[Layer]:
    """The back of the hand is straight and parallel to the base line; forearm in a sleeve."""
    knuckle = subject.radii[0]
    parts = ((-135.0, 9.0), (-78.0, 6.5), (-2.0, 1.0))
    radii = np.array([knuckle + part[1] for part in parts])
    limb = Limb(np.array(parts), radii, 0.0, 0.0, 8.0)
    seen = _seen(limb, pixels)
    if seen:
        box, field, share = seen
        albedo = skin_albedo(field, subject.skin, Wrinkles(), look.seed, 2)
        if not look.thumb:
            _paint(albedo, pixels, box, np.array([BASE_DOT]), look)
        yield Layer(box, shade(field, albedo, look.light), share)
    sleeve = Limb(np.array([(-220.0, 11.0), (-104.0, 8.0)]), np.array([31.0, 25.0]), 0.0, 0.0)
    seen = _seen(sleeve, pixels)
    if seen:
        box, field, share = seen
        # Cut off: a sleeve ends, it has no cap.
        share = share * cover(pixels.x[box] + 98.0, pixels.size[box])
        cloth = textured(pixels.x[box], pixels.y[box], 2.0, look.seed, 3)
        weave = 1.0 + np.float32(0.12) * cloth
        albedo = np.asarray(_SLEEVE, dtype=np.float32)[:, None, None] * weave
        yield Layer(box, shade(field, albedo, look.light, 0.0), share)


def _index(subject: Subject, angles: Array, pixels: Pixels, look: Look) -> Iterator[Layer]:
    joints = chain(subject.lengths, angles, (0.0, 0.0))
    # A piece of the metacarpal, so that the knuckle is round and the finger grows out of the palm.
    limb = Limb(
        np.concatenate([[(-26.0, 0.0)], joints]),
        np.array([subject.radii[0], *subject.radii]),
    )
    seen = _seen(limb, pixels)
    if seen is None:
        return
    box, field, share = seen
    wrinkles = Wrinkles(_ends(limb)[1:-1], tuple(angles), subject.crease)
    albedo = skin_albedo(field, subject.skin, wrinkles, look.seed, 0)
    _nail(albedo, limb, pixels, box)
    _paint(albedo, pixels, box, joints, look)
    # Towards the wrist the palm's own surface goes on.
    grown = np.clip((field.along - 4.0) / 16.0, 0.0, 1.0)
    yield Layer(box, shade(field, albedo, look.light), share * grown)


def _thumb(subject: Subject, thumb: Array, pixels: Pixels, look: Look) -> Iterator[Layer]:
    joints = chain(subject.thumb, thumb, THUMB_BASE)
    base, knuckle, _, tip = subject.radii
    radii = np.array([base * 1.55, knuckle * 1.22, knuckle * 1.08, tip * 1.2])
    limb = Limb(joints, radii, pad=0.0)
    seen = _seen(limb, pixels)
    if seen is None:
        return
    box, field, share = seen
    # A thumb that opposes the fingers bends the other way.
    field = field._replace(across=-field.across)
    wrinkles = Wrinkles(_ends(limb)[1:-1], tuple(-thumb[1:]), subject.crease)
    skin = subject.skin if look.thumb else tuple(0.8 * one for one in subject.skin)
    albedo = skin_albedo(field, skin, wrinkles, look.seed, 4)
    _nail(albedo, limb, pixels, box, -1.0)
    if look.thumb:
        _paint(albedo, pixels, box, joints, look)
        # The ball of the thumb grows out of the palm.
        share = share * np.clip((field.along + 14.0) / 9.0, 0.0, 1.0)
    yield Layer(box, shade(field, albedo, look.light), share)


def _nail(albedo: Picture, limb: Limb, pixels: Pixels, box: Box, side: float = 1.0) -> None:
    """From the side a nail is a pale sliver on the back of the last bone, which ends beyond it."""
    first, last = limb.joints[-2:]
    length = float(np.hypot(*(last - first)))
    u = (last - first) / length
    back = side * np.array([u[1], -u[0]])
    radius = float(limb.radii[-1])
    ends = np.array(
        [
            first + 0.5 * (last - first) + back * (0.80 * limb.radii[-2]),
            last + u * (0.8 * radius) + back * (0.72 * radius),
        ]
    )
    near = pixels.box(ends, 1.3 + MARGIN_MM)
    if near is None:
        return
    sliver = field_of(Limb(ends, np.array([1.3, 1.1]), 0.0, 0.0), pixels, near)
    # Its box lies within the limb's, whose margin is wider.
    (rows, columns), (top, left) = near, (box[0].start, box[1].start)
    part = albedo[:, rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    share = cover(sliver.distance, pixels.size[near])
    bright = np.asarray(_NAIL, dtype=np.float32)[:, None, None] * np.float32(1.6 * albedo.mean())
    part += np.float32(0.8) * share * (bright - part)
    rim = np.abs(sliver.distance) - np.float32(0.15)
    part *= 1.0 - np.float32(0.25) * cover(rim, pixels.size[near])


def _paint(albedo: Picture, pixels: Pixels, box: Box, dots: Array, look: Look) -> None:
    if look.dots is None:
        return
    x, y, size = pixels.x[box], pixels.y[box], pixels.size[box]
    painted(albedo, x, y, dots, _DOT_RADIUS_MM, look.dots, size)


def _ends(limb: Limb) -> tuple[float, ...]:
    """How far along the limb its joints are, mm."""
    steps = np.hypot(*np.diff(limb.joints, axis=0).T)
    return (0.0, *(float(one) for one in np.cumsum(steps)))
