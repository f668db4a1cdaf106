"""The choice of motion models: Bayes' rule, strikes, and what becomes of wild observations."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.model_choice import (
    LEAK,
    OUT,
    choose_parents,
    count_strikes,
    update_probabilities,
)

CALM_AND_LIVELY = (0.1, 1e5)
OFF, UP = np.array([0.01, 0.0]), np.array([0.0, 1.0, 0.0])


def test_probabilities_follow_bayes_rule():
    prior, posterior = np.array([0.5, 0.3, 0.2]), np.empty(3)
    log_likelihoods = np.array([-1.0, -900.0, 2.0])
    total = update_probabilities(prior, log_likelihoods, posterior)
    expected = ((1.0 - LEAK) * prior + LEAK / 3) * np.exp(log_likelihoods)
    assert total == pytest.approx(np.log(expected.sum()))
    np.testing.assert_allclose(posterior, expected / expected.sum(), atol=1e-300)


@pytest.mark.parametrize(("took", "at"), [([False] * 9, 1), ([False, True] * 5, 4)])
def test_a_model_is_out_that_keeps_passing_over_what_the_likeliest_takes(took, at):
    """Expected: at the second observation running, at the third of every other one."""
    strikes = np.zeros(2, dtype=np.int64)
    counts = []
    for mine in took:
        count_strikes(strikes.copy(), np.array([mine, True]), 1, strikes)
        counts.append(strikes[0])
    assert np.flatnonzero(np.array(counts) >= OUT)[0] == at
    assert strikes[1] == 0


def test_what_nobody_likely_takes_is_no_strike():
    after = np.empty(2, dtype=np.int64)
    count_strikes(np.array([2, 1]), np.array([False, False]), 0, after)
    assert after.tolist() == [2, 1]


def test_who_is_out_goes_on_from_the_likeliest_and_begins_anew():
    parent, after = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    strikes = np.array([OUT, 0, OUT - 1])
    choose_parents(np.array([0.1, 0.2, 0.7]), strikes, parent)
    assert parent.tolist() == [2, 1, 2]
    count_strikes(strikes, np.array([True, True, True]), 2, after)
    assert after.tolist() == [0, 0, OUT - 2]


def still_track(one_track):
    """A second of a still landmark, two models, two cameras in turn."""
    track, random = one_track(densities=CALM_AND_LIVELY), np.random.default_rng(0)
    for k in range(1, 31):
        track.add(k / 60.0, k % 2, track.seen(k % 2, track.START_M, random), gate=30.0)
    return track, random


def test_a_wild_ray_of_one_camera_is_doubted_and_then_forgotten(one_track):
    """Test: one ray 5 px off. Expected: sigma tells at once; soon the place is known again."""
    track, random = still_track(one_track)
    before = np.sqrt(np.diag(track.at(0.5)[1])[:3])
    track.add(31 / 60.0, 1, track.seen(1, track.START_M, random) + OFF, gate=30.0)
    assert (np.sqrt(np.diag(track.at(31 / 60.0)[1])[:3]) > before).all()
    for k in range(32, 36):
        track.add(k / 60.0, k % 2, track.seen(k % 2, track.START_M, random), gate=30.0)
    for k in (31, 35):
        mean, cov = track.at(k / 60.0)
        np.testing.assert_array_less(
            np.abs(mean[:3] - track.START_M), 4.0 * np.sqrt(np.diag(cov)[:3])
        )
        assert np.linalg.norm(mean[:3] - track.START_M) < 0.002


def test_a_sharp_turn_that_both_cameras_see_is_followed_by_all_models(one_track):
    """Test: a still landmark leaves at 1 m/s within a frame.

    Expected: every model is with it three frames later, the past of each led there, and the
    instants of the turn are within their sigmas.
    """
    track, random = still_track(one_track)
    paths = {}
    for k in range(31, 37):
        paths[k] = track.START_M + (k - 30.5) / 60.0 * UP
        track.add(k / 60.0, k % 2, track.seen(k % 2, paths[k], random), gate=30.0)
    newest = track.newest()
    for m in range(2):
        error = track.history.state[0, newest, m, :2] - paths[36][:2]
        assert np.abs(error).max() < 0.005
    for k, place in paths.items():
        mean, cov = track.at(k / 60.0)
        np.testing.assert_array_less(np.abs(mean[:3] - place), 4.0 * np.sqrt(np.diag(cov)[:3]))
