"""Dots of fingers that move sharply keep their names, and specks are none of them."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.tracker import DotTracker

NAMES = ("wrist", "index_proximal", "index_intermediate", "index_distal", "index_tip")
# A finger that closes within four pictures at 12 Hz, as rendered: wrist to tip.
CLOSING = (
    [(126, 152), (211, 150), (291, 151), (335, 158), (371, 168)],
    [(125, 153), (210, 151), (290, 152), (328, 175), (353, 204)],
    [(124, 154), (209, 151), (284, 178), (291, 222), (272, 254)],
    [(123, 154), (208, 152), (238, 226), (195, 242), (167, 218)],
    [(122, 155), (207, 152), (213, 232), (169, 224), (162, 188)],
)


def _patches(places: object) -> list[Patch]:
    return [Patch(float(x), float(y), 85.0) for x, y in np.asarray(places)]


def _tracker() -> DotTracker:
    seeds = {name: (float(x), float(y)) for name, (x, y) in zip(NAMES, CLOSING[0], strict=True)}
    return DotTracker(NAMES, (480, 360), seeds)


def test_a_finger_that_closes_at_once_keeps_all_its_dots() -> None:
    tracker = _tracker()
    for number, places in enumerate(CLOSING):
        dots = tracker.step(_patches(places), number / 12.0)
        for name, (x, y) in zip(NAMES, places, strict=True):
            assert (round(dots[name].x_px), round(dots[name].y_px)) == (x, y), (number, name)
            assert dots[name].state == "seen"


def test_a_speck_that_was_there_before_is_no_lost_dot() -> None:
    tracker, speck = _tracker(), (345, 235)
    for number in range(4):
        tracker.step(_patches([*CLOSING[0], speck]), number / 30.0)
    for number in range(4, 10):
        dots = tracker.step(_patches([*CLOSING[0][:4], speck]), number / 30.0)
        assert dots["index_tip"].state == "carried"
        assert np.hypot(dots["index_tip"].x_px - 371, dots["index_tip"].y_px - 168) < 30.0
