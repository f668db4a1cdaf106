"""The history of tracks: how one begins, and its order of time."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.track_history import (
    empty_history,
    filtered,
    newest_node,
    nodes_until,
    start_track,
)


def test_a_new_track_is_its_prior():
    history, sigmas = empty_history(2, 3), np.array([0.1, 1.0, 10.0])
    start_track(history, 1, 5.0, np.array([0.1, 0.2, 0.3]), sigmas)
    assert history.size.tolist() == [0, 1]
    node = newest_node(history, 1)
    assert history.camera[1, node] == -1
    assert history.probability[1, node].sum() == pytest.approx(1.0)
    for m in range(3):
        prior = filtered(history, 1, node, m)
        np.testing.assert_array_equal(prior.mean, [0.1, 0.2, 0.3, *[0.0] * 6])
        np.testing.assert_allclose(prior.cov, np.diag(np.repeat(sigmas**2, 3)))


def test_nodes_are_counted_by_time(curved_track):
    track = curved_track(order=[0, 1, 3, 2, 5, 4, 8, 6, 7, 9, 11, 10])
    times_s = [-0.001, *(time_s for time_s, _, _ in track.observed)]
    for k, time_s in enumerate(times_s):
        assert nodes_until(track.history, 0, time_s) == k + 1
        assert nodes_until(track.history, 0, time_s - 1e-6) == k
    assert history_times(track) == times_s


def history_times(track) -> list[float]:
    nodes = track.history.order[0, : track.history.size[0]]
    return track.history.time_s[0, nodes].tolist()


def test_starting_again_forgets_the_nodes_before(curved_track):
    track = curved_track()
    start_track(track.history, 0, 1.0, track.START_M, np.full(3, 0.1))
    assert history_times(track) == [1.0]
