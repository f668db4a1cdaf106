"""How unlike its model's the paint of a hand is: by the scatter of areas over its tips and time."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.paint.paint_shape import take_look, tell_shapes

FRAME_S = 1 / 30


def shapes(ratios: Array, hands: Array) -> Array:
    """Of L landmarks, whose ratios (n, L) one camera saw, as logarithms."""
    count = ratios.shape[1]
    sums, usual, shape_sds = np.zeros((count, 1, 3)), np.full((count, 2), np.nan), np.zeros(count)
    tell_shapes(sums, hands, usual, shape_sds)
    for n, looks in enumerate(ratios):
        for row, ratio in enumerate(looks):
            take_look(sums[row, 0], usual[row], ratio, FRAME_S if n else np.inf)
        tell_shapes(sums, hands, usual, shape_sds)
    return shape_sds


def test_at_first_some_shape_is_expected():
    expected = shapes(np.zeros((0, 3)), np.zeros(3, dtype=np.int64))
    assert np.all((expected > 0.03) & (expected < 0.12))


@pytest.mark.parametrize("scatter", [0.0, 0.05, 0.1, 0.15, 0.5])
def test_it_is_the_scatter_above_what_the_models_own_hands_have(scatter):
    random = np.random.default_rng(3)
    for ratios in (
        # Over time, and over tips.
        random.normal(0.2, scatter, (600, 4)),
        np.tile(0.2 + scatter * np.array([-1.0, 1.0, -1.0, 1.0]), (600, 1)),
    ):
        shape_sd = shapes(ratios, np.zeros(4, dtype=np.int64))
        assert np.ptp(shape_sd) == 0.0
        wanted = min(1.4 * np.sqrt(max(scatter**2 - 0.075**2, 0.0)), 0.11)
        assert shape_sd[0] == pytest.approx(wanted, abs=0.015)


def test_each_hand_has_its_own_size_and_shape():
    """One whose tips are all larger, beside one whose tips are not alike."""
    ratios = np.tile([0.3, 0.3, 0.0, 0.4], (600, 1))
    alike, _, unlike, _ = shapes(ratios, np.array([0, 0, 1, 1]))
    assert alike == 0.0
    assert unlike == 0.11


def test_a_hand_that_is_known_exactly_has_its_models_shape():
    ratios = np.tile([0.0, 0.5, 0.0, 0.5], (600, 1))
    assert shapes(ratios, np.array([0, 0, -1, -1])).tolist() == [0.11, 0.11, 0.0, 0.0]


def test_what_was_long_ago_is_forgotten():
    ratios = np.concatenate([np.tile([0.0, 0.5], (150, 1)), np.zeros((2400, 2))])
    hands = np.zeros(2, dtype=np.int64)
    assert shapes(ratios[:150], hands)[0] == 0.11
    assert shapes(ratios, hands)[0] == 0.0


def test_a_tip_that_is_hidden_now_and_then_says_little():
    """From all cameras alike, a fifth of the time and by two thirds of it."""
    ratios = np.random.default_rng(4).normal(0.0, 0.04, (600, 5))
    ratios[np.arange(600) % 100 < 20, 0] -= 1.1
    assert shapes(ratios, np.zeros(5, dtype=np.int64))[0] < 0.06
