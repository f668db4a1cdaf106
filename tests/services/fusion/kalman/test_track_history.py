"""The ring: equal to a dense filter and Rauch-Tung-Striebel smoother, in whatever order
observations come.
"""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.triangulation import extrinsics
from services.fusion.kalman.motion_model import transition, unit_noise
from services.fusion.kalman.track_history import (
    ACCEPTED,
    GATED,
    LATE,
    NODES,
    empty_ring,
    insert,
    query_all,
    start,
)
from testing.synthetic_points import Setup

DENSITIES = np.array([40.0])
SIGMAS = np.array([0.02, 0.5, 5.0])
SIGMA = 1e-4
START_M = np.array([0.05, 0.0, 0.6])


@pytest.fixture
def world():
    """Extrinsics and 12 noisy looks (time, camera, ray) at a curved path."""
    cameras = tuple(Setup().rig().values())
    R, t = extrinsics(cameras)
    random = np.random.default_rng(4)
    looks = []
    for k in range(12):
        time_s = k / 60.0 + 0.001 * random.random()
        p = START_M + np.array([0.3 * time_s, 0.2 * np.sin(4 * time_s), -0.2 * time_s**2])
        q = R[k % 2] @ p + t[k % 2]
        looks.append((time_s, k % 2, q[:2] / q[2] + random.normal(0.0, SIGMA, 2)))
    return R, t, looks


def put(ring, look, R, t, gate=np.inf, densities=DENSITIES) -> int:
    time_s, camera, ray = look
    return int(
        insert(ring, 0, time_s, camera, ray, np.array([SIGMA**2, 0.0]), gate, R, t, densities)
    )


def ask(ring, time_s, densities=DENSITIES):
    means, covs = np.zeros((1, 6)), np.zeros((1, 6, 6))
    assert query_all(ring, time_s, densities, means, covs)[0]
    return means[0], covs[0]


def filled(world, order=None, densities=DENSITIES):
    R, t, looks = world
    ring = empty_ring(1, len(densities))
    start(ring, 0, -0.001, START_M, SIGMAS)
    for k in order or range(len(looks)):
        assert put(ring, looks[k], R, t, densities=densities) == ACCEPTED
    return ring


def rts(ring):
    """Smoothed states of all nodes from the stored filtered ones, by Rauch, Tung and Striebel's
    recursion.
    """
    nodes = ring.order[0, : ring.filled[0]]
    x, P, times = ring.state[0, nodes, 0], ring.cov[0, nodes, 0], ring.time_s[0, nodes]
    xs, Ps = x.copy(), P.copy()
    for k in range(len(nodes) - 2, -1, -1):
        dt, noise = times[k + 1] - times[k], np.empty((3, 3))
        f01, f02, f12, f22 = transition(dt)
        F = np.kron(np.array([[1.0, f01, f02], [0.0, 1.0, f12], [0.0, 0.0, f22]]), np.eye(3))
        unit_noise(dt, noise)
        prior = F @ P[k] @ F.T + DENSITIES[0] * np.kron(noise, np.eye(3))
        C = P[k] @ F.T @ np.linalg.inv(prior)
        xs[k] = x[k] + C @ (xs[k + 1] - F @ x[k])
        Ps[k] = P[k] + C @ (Ps[k + 1] - prior) @ C.T
    return times, xs, Ps


def test_smoothing_equals_rauch_tung_striebel(world):
    ring = filled(world)
    times, xs, Ps = rts(ring)
    for k in range(1, len(times)):
        mean, cov = ask(ring, times[k])
        np.testing.assert_allclose(mean, xs[k, :6], rtol=0, atol=1e-8)
        scale = np.sqrt(np.diag(Ps[k])[:6])
        np.testing.assert_allclose(
            cov / np.outer(scale, scale), Ps[k, :6, :6] / np.outer(scale, scale), rtol=0, atol=1e-3
        )


def test_between_observations_the_estimate_runs_smoothly(world):
    ring = filled(world)
    node_s = ring.time_s[0, ring.order[0, 6]]
    before, at, after = (ask(ring, node_s + step_s)[0][:3] for step_s in (-1e-7, 0.0, 1e-7))
    np.testing.assert_allclose(before, at, atol=1e-6)
    np.testing.assert_allclose(after, at, atol=1e-6)


def test_velocity_is_the_derivative_of_position(world):
    ring = filled(world)
    mean, _ = ask(ring, 0.095)
    numeric = (ask(ring, 0.0951)[0][:3] - ask(ring, 0.0949)[0][:3]) / 2e-4
    np.testing.assert_allclose(mean[3:], numeric, atol=1e-4)


def test_the_order_of_arrival_hardly_matters(world):
    """Only the derivatives of the projection are taken at slightly different places."""
    ordered, shuffled = filled(world), filled(world, order=[0, 1, 3, 2, 5, 4, 8, 6, 7, 9, 11, 10])
    for time_s in (0.05, 0.1, 0.19):
        np.testing.assert_allclose(
            ask(ordered, time_s)[0][:3], ask(shuffled, time_s)[0][:3], atol=5e-5
        )


def test_smoothing_reduces_and_prediction_grows_the_variance(world):
    ring = filled(world)
    newest_s = ring.time_s[0, ring.order[0, ring.filled[0] - 1]]
    depth = [np.sqrt(ask(ring, newest_s + step_s)[1][2, 2]) for step_s in (-0.05, 0.0, 0.02, 0.1)]
    assert depth == sorted(depth)


def test_what_contradicts_is_gated_and_leaves_no_trace(world):
    R, t, looks = world
    ring = filled(world)
    before = ask(ring, 0.19)
    time_s, camera, ray = looks[-1]
    assert put(ring, (time_s + 0.01, camera, ray + 0.05), R, t, gate=30.0) == GATED
    after = ask(ring, 0.19)
    np.testing.assert_array_equal(before[0], after[0])
    np.testing.assert_array_equal(before[1], after[1])


def test_the_ring_forgets_the_oldest_and_refuses_what_is_older(world):
    R, t, looks = world
    ring = filled(world)
    for k in range(3 * NODES):
        assert put(ring, (0.25 + k / 60.0, k % 2, looks[-1][2]), R, t) == ACCEPTED
    assert ring.filled[0] == NODES
    assert sorted(ring.order[0].tolist()) == list(range(NODES))
    assert put(ring, looks[0], R, t) == LATE


def test_belief_goes_to_the_model_that_fits(world):
    R, t, _ = world
    densities, random = np.array([0.1, 1000.0]), np.random.default_rng(0)
    for lively in (False, True):
        ring = empty_ring(1, 2)
        start(ring, 0, 0.0, START_M, SIGMAS)
        for k in range(1, 60):
            p = START_M + ([0.0, 0.05 * np.sin(k * 0.5), 0.0] if lively else 0.0)
            q = R[k % 2] @ p + t[k % 2]
            put(
                ring,
                (k / 60.0, k % 2, q[:2] / q[2] + random.normal(0.0, SIGMA, 2)),
                R,
                t,
                densities=densities,
            )
        belief = ring.belief[0, ring.order[0, ring.filled[0] - 1]]
        assert belief.sum() == pytest.approx(1.0)
        assert np.argmax(belief) == int(lively)


def test_evidence_is_how_likely_the_latest_observation_was(world):
    """Test: one model; its innovation is Gaussian.

    Expected: the log-density of the textbook, and less of it for what fits less.
    """
    R, t, looks = world
    ring = filled(world)
    node = ring.order[0, ring.filled[0] - 1]
    nu, Si = ring.nu[0, node, 0], ring.Si[0, node, 0]
    expected = -0.5 * (nu @ Si @ nu) + 0.5 * np.log(np.linalg.det(Si)) - np.log(2.0 * np.pi)
    assert ring.evidence[0] == pytest.approx(expected)
    time_s, camera, ray = looks[-1]
    put(ring, (time_s + 1 / 60, camera, ray + 0.002), R, t)
    assert ring.evidence[0] < expected
