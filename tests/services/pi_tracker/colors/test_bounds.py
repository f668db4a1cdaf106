"""Bounds of a colour between its paint and what is not to be taken for it."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.colors.bounds import bounds, hues_of
from services.pi_tracker.image.chroma import Cells

PICTURES = 5


def cells(hue_steps, chroma=60.0):
    """Cells of one luma and chroma, whose hues are so many steps (of 2 deg) from violet's."""
    angle = np.deg2rad(40.0 - 2.0 * np.asarray(hue_steps))
    return Cells(np.full(angle.shape, 90.0), chroma * np.cos(angle), chroma * np.sin(angle))


def width_of(found):
    """How many hues a range has."""
    return (found.hsv_high[0] - found.hsv_low[0]) % 180


def test_a_few_cells_of_a_room_do_not_make_hues_narrow_but_a_thing_does():
    random = np.random.default_rng(3)
    paint = cells(random.normal(0.0, 1.2, 40 * PICTURES))
    room = cells(random.uniform(-12.0, 12.0, 15 * PICTURES))
    thing = cells(random.normal(6.0, 0.5, 400 * PICTURES))
    hues = hues_of(paint)
    alone = bounds(paint, hues, [], cells([]), PICTURES)
    beside_few = bounds(paint, hues, [], room, PICTURES)
    beside_thing = bounds(paint, hues, [], thing, PICTURES)
    assert (beside_few.hsv_low[0], beside_few.hsv_high[0]) == (alone.hsv_low[0], alone.hsv_high[0])
    assert width_of(alone) >= 12
    assert width_of(beside_thing) <= width_of(alone) - 3
