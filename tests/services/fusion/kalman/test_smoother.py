"""The smoother: equal to Rauch, Tung and Striebel's, in whatever order observations come."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.kalman.motion_model import discretize, empty_step


def rts(track):
    """Smoothed states of all nodes from the filtered ones, by Rauch, Tung and Striebel."""
    history = track.history
    nodes = history.order[0, : history.size[0]]
    x, P, times = history.state[0, nodes, 0], history.cov[0, nodes, 0], history.time_s[0, nodes]
    xs, Ps = x.copy(), P.copy()
    for k in range(len(nodes) - 2, -1, -1):
        step = empty_step()
        discretize(times[k + 1] - times[k], track.models[0], step)
        F = np.kron(step.F, np.eye(3))
        density, _, _, along = track.models[0]
        way = history.way[0, nodes[k]]
        noise = np.eye(3) + along / density * way / np.trace(way)
        prior = F @ P[k] @ F.T + np.kron(step.Q, noise)
        C = P[k] @ F.T @ np.linalg.inv(prior)
        xs[k] = x[k] + C @ (xs[k + 1] - F @ x[k])
        Ps[k] = P[k] + C @ (Ps[k + 1] - prior) @ C.T
    return times, xs, Ps


@pytest.mark.parametrize("along", [0.0, 4000.0])
def test_smoothing_equals_rauch_tung_striebel(curved_track, along):
    track = curved_track(along=along)
    times, xs, Ps = rts(track)
    for k in range(1, len(times)):
        mean, cov = track.at(times[k])
        np.testing.assert_allclose(mean, xs[k, :3], rtol=0, atol=1e-8)
        scale = np.sqrt(np.diag(Ps[k])[:3])
        np.testing.assert_allclose(
            cov / np.outer(scale, scale), Ps[k, :3, :3] / np.outer(scale, scale), rtol=0, atol=1e-3
        )


def test_between_observations_the_estimate_runs_smoothly(curved_track):
    track = curved_track()
    node_s = track.history.time_s[0, track.history.order[0, 6]]
    before, at, after = (track.at(node_s + step_s)[0] for step_s in (-1e-7, 0.0, 1e-7))
    np.testing.assert_allclose(before, at, atol=1e-6)
    np.testing.assert_allclose(after, at, atol=1e-6)


def test_smoothing_reduces_and_prediction_grows_the_variance(curved_track):
    track = curved_track()
    newest_s = track.history.time_s[0, track.newest()]
    depth = [np.sqrt(track.at(newest_s + step_s)[1][2, 2]) for step_s in (-0.05, 0.0, 0.02, 0.1)]
    assert depth == sorted(depth)
