"""Several motion models: their probabilities, and how well an observation fits."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.mark.parametrize("lively", [False, True])
def test_probability_goes_to_the_model_that_fits(one_track, lively):
    track, random = one_track(densities=(0.1, 1000.0)), np.random.default_rng(0)
    for k in range(1, 60):
        shift = [0.0, 0.05 * np.sin(k * 0.5), 0.0] if lively else 0.0
        track.add(k / 60.0, k % 2, track.seen(k % 2, track.START_M + shift, random))
    probability = track.history.probability[0, track.newest()]
    assert probability.sum() == pytest.approx(1.0)
    assert np.argmax(probability) == int(lively)


def test_log_likelihood_is_that_of_the_latest_observation(curved_track):
    """Test: one model; its innovation is Gaussian.

    Expected: the log-density of the textbook, and less of it for what fits less.
    """
    track = curved_track()
    history, node = track.history, track.newest()
    nu, S_inverse = history.nu[0, node, 0], history.S_inverse[0, node, 0]
    expected = (
        -0.5 * (nu @ S_inverse @ nu) + 0.5 * np.log(np.linalg.det(S_inverse)) - np.log(2.0 * np.pi)
    )
    assert history.log_likelihood[0] == pytest.approx(expected)
    time_s, camera, ray = track.observed[-1]
    track.add(time_s + 1 / 60, camera, ray + 0.002)
    assert history.log_likelihood[0] < expected
