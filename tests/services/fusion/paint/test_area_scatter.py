"""What the scatter of areas over a hand's tips and time says of its directions and its paint."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.paint.area_scatter import judge_hands, take_look
from services.fusion.paint.known_paint import KnownPaint
from testing.untold_paint import untold_paint

FRAME_S = 1 / 30


def judged(
    ratios: Array, hands: Array, by_direction: float = 0.0, misfit: float = 0.0
) -> KnownPaint:
    """Paint of L landmarks, whose ratios (n, L) one camera saw, as logarithms.

    by_direction: what directions make of each, one standard deviation; misfit: of its hand's bones.
    """
    count = ratios.shape[1]
    sums, usual = np.zeros((count, 1, 4)), np.full((count, 2), np.nan)
    paint = untold_paint(count, hands=hands, misfits=np.full(count, misfit))
    judge_hands(sums, usual, paint)
    for n, looks in enumerate(ratios):
        for row, ratio in enumerate(looks):
            take_look(sums[row, 0], usual[row], ratio, by_direction, FRAME_S if n else np.inf)
        judge_hands(sums, usual, paint)
    return paint


def shapes(ratios: Array, hands: Array) -> Array:
    """How unlike its model's the paint of each landmark is."""
    return judged(ratios, hands).shape_sds


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
        wanted = min(1.6 * np.sqrt(max(scatter**2 - 0.08**2, 0.0)), 0.11)
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


def test_directions_are_as_sure_as_areas_keep_to_them():
    """Noise and limits apart: half of what was told where they scatter by half of it."""
    random = np.random.default_rng(5)
    hands = np.zeros(4, dtype=np.int64)
    for scatter in (0.0, 0.05, 0.1, 0.3):
        ratios = random.normal(0.0, np.hypot(scatter, 0.05), (600, 4))
        share = judged(ratios, hands, 0.2).direction_shares
        assert np.ptp(share) == 0.0
        wanted = min(max(scatter / 0.2, np.sqrt(0.1)), 1.0)
        assert share[0] == pytest.approx(wanted, abs=0.04)


def test_what_directions_explain_is_less_of_another_shape():
    ratios = np.random.default_rng(6).normal(0.0, 0.12, (600, 4))
    hands = np.zeros(4, dtype=np.int64)
    assert judged(ratios, hands, 0.2).shape_sds[0] < 0.03
    assert judged(ratios, hands, 0.0).shape_sds[0] > 0.1


def test_a_hand_that_is_known_exactly_keeps_its_directions():
    ratios = np.zeros((600, 4))
    shares = judged(ratios, np.array([0, 0, -1, -1]), 0.2).direction_shares
    assert shares[0] == shares[1] < 0.4
    assert shares[2:].tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("misfit", "share"), [(0.5, 0.1), (0.75, 0.55), (1.0, 1.0), (3.0, 1.0)])
def test_only_hands_that_fit_their_bones_have_surer_directions(misfit, share):
    """Shares of variances; areas agree with the model's."""
    shares = judged(np.zeros((600, 4)), np.zeros(4, dtype=np.int64), 0.2, misfit).direction_shares
    np.testing.assert_allclose(shares**2, share)
