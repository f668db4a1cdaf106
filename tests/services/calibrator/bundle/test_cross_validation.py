"""Cross-validation: folds, and the influence of one position on the others."""

from __future__ import annotations

import math

import numpy as np
import pytest

from services.calibrator.bundle.cross_validation import (
    folds,
    held_out_rms,
    influence_percent,
    suspects,
)


@pytest.mark.parametrize("count", [3, 10, 23])
def test_folds_hold_every_picture_once(count):
    parts = folds(count)
    assert sorted(np.concatenate(parts).tolist()) == list(range(count))
    assert len(parts) == min(count, 10)


def test_influence_is_the_mean_rise_of_the_others_errors():
    assert influence_percent([1.1, 1.3], [1.0, 1.0]) == pytest.approx(20.0)
    assert influence_percent([], []) == 0.0


def test_far_off_and_influential_positions_are_suspect():
    assert suspects([0.1, 0.1, 0.5, 0.1], [0.0, 6.0, 0.0, 0.0]) == [False, True, True, False]
    assert suspects([], []) == []


def test_nothing_held_out_is_no_small_error():
    assert held_out_rms([3.0, 4.0]) == pytest.approx(math.sqrt(12.5))
    assert held_out_rms([]) == math.inf
