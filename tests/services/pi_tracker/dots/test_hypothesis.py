"""How likely it is that a dot is missing, or found again."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.hypothesis import Known, View
from services.pi_tracker.dots.tracker import arrays_of

AREA_PX2, FALSE_DENSITY = 300.0, 1e-7


def _view(unseen: int, showing: float) -> View:
    """One dot that was not seen in so many pictures, and a patch of its size."""
    known = Known(0.0, np.array([AREA_PX2]), np.array([unseen]), np.zeros((0, 2)))
    patches = arrays_of([Patch(100.0, 100.0, AREA_PX2)])
    return View(known, patches, FALSE_DENSITY, np.array([showing]))


def _missing(unseen: int, showing: float = 1.0) -> float:
    """What it costs that the dot is missing, nats."""
    return -_view(unseen, showing).claims(np.array([-1]))


def test_the_longer_a_dot_was_hidden_the_less_it_is_missed() -> None:
    """Expected: 3 % miss what was there, 40 % what was hidden once; then it stays so."""
    costs = [_missing(unseen) for unseen in range(20)]
    assert costs[:2] == pytest.approx([-np.log(0.03), -np.log(0.4)])
    assert all(after < before for before, after in pairwise(costs))
    assert costs[-1] == pytest.approx(_missing(1, showing=-1.0), abs=1e-3)


def test_a_dot_that_was_hidden_for_long_is_still_found_where_it_is_expected() -> None:
    """Expected: a patch at its place is worth far more than none (a px^2 of density 1e-7)."""
    gains = [float(_view(unseen, 1.0).alone()[0, 0]) for unseen in (0, 1, 5, 50)]
    assert gains == sorted(gains, reverse=True)
    assert gains[-1] > 10.0


def test_a_dot_that_faces_away_is_not_missed() -> None:
    for unseen in (0, 1, 10):
        assert _missing(unseen, showing=-1.0) == pytest.approx(-np.log(0.9), abs=1e-9)
