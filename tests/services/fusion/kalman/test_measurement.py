"""The update by one ray, and its adjoint, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.projection import extrinsics
from services.fusion.kalman.measurement import (
    Innovation,
    Look,
    adjoint_update,
    innovate,
    predict_ray,
    shrink,
    take,
)
from services.fusion.kalman.relinearise import linearise_where_it_leads
from testing.synthetic_points import SyntheticRig

LANDMARK, SIZE, DELAY_S = 1, 28, 0.004


@pytest.fixture
def look() -> Look:
    """Of the second of three landmarks."""
    cameras = extrinsics(tuple(SyntheticRig(toe_in_rad=0.05).rig().values()))
    return Look(LANDMARK, DELAY_S, np.array([0.11, 0.02]), 1e-8, cameras.R[1], cameras.t[1])


@pytest.fixture
def state() -> tuple[np.ndarray, np.ndarray]:
    """Mean (28,) and covariance (28, 28) of three landmarks and the clock."""
    random = np.random.default_rng(1)
    x = random.normal(0.0, 0.1, SIZE)
    x[[2, 5, 8]] += 0.7
    x[27] = 1e-4
    root = random.normal(0.0, 1e-3, (SIZE, SIZE))
    P = root @ root.T
    P[27, :27] = P[:27, 27] = 0.0  # a clock's error lives for one frame
    return x, P


NONE_TAKEN = np.empty((0, SIZE)), 0
HERE = (0.0, 0.0, 0.0)


def empty() -> Innovation:
    return Innovation(
        np.zeros((2, 3)),
        np.zeros(2),
        np.zeros(2),
        np.zeros((2, 2)),
        np.zeros((2, SIZE)),
        np.zeros(1),
    )


def dense_jacobian(innovation: Innovation, landmark: int = LANDMARK) -> np.ndarray:
    """H (2, 28) of the ray by the whole state."""
    H = np.zeros((2, SIZE))
    for order, weight in enumerate((1.0, DELAY_S, 0.5 * DELAY_S**2)):
        at = 9 * order + 3 * landmark
        H[:, at : at + 3] = weight * innovation.H
    H[:, 27] = innovation.drift
    return H


def test_jacobian_by_finite_differences(look, state):
    x, _ = state
    innovation = empty()
    assert predict_ray(x, look, HERE, innovation)
    H = dense_jacobian(innovation)
    x[27] = 0.0  # the drift itself depends on the velocity, by clock errors of .1 ms
    for i in range(27):
        step = np.zeros(SIZE)
        step[i] = 1e-6
        ahead, back = empty(), empty()
        predict_ray(x + step, look, HERE, ahead)
        predict_ray(x - step, look, HERE, back)
        np.testing.assert_allclose((back.nu - ahead.nu) / 2e-6, H[:, i], atol=1e-6)


def test_update_by_several_looks_is_the_dense_one(look, state):
    """One after the other, as each is linearised where the ones before it have left the state."""
    x, P = state
    new_x, new_P, taken, known = x.copy(), P.copy(), np.empty((4, SIZE)), 0
    for landmark in (0, LANDMARK):
        one = look._replace(landmark=landmark)
        innovation = empty()
        determinant = innovate(new_x, new_P, taken, known, one, innovation)
        known = take(new_x, taken, known, innovation)
        H = dense_jacobian(innovation, landmark)
        S = H @ P @ H.T + one.ray_variance * np.eye(2)
        K = P @ H.T @ np.linalg.inv(S)
        nu = innovation.nu
        assert determinant == pytest.approx(np.linalg.det(S), rel=1e-6)
        assert innovation.distance[0] == pytest.approx(nu @ np.linalg.solve(S, nu), rel=1e-6)
        np.testing.assert_allclose(innovation.K.T, K, rtol=1e-6, atol=1e-8 * np.abs(K).max())
        x, P = x + K @ nu, P - K @ S @ K.T
        np.testing.assert_allclose(new_x, x, rtol=1e-7)
    shrink(new_P, taken, known)
    np.testing.assert_allclose(new_P, P, atol=1e-12)


def test_an_innovation_changes_nothing_by_itself(look, state):
    x, P = state
    new_x, new_P = x.copy(), P.copy()
    innovate(new_x, new_P, *NONE_TAKEN, look, empty())
    np.testing.assert_array_equal(new_x, x)
    np.testing.assert_array_equal(new_P, P)


@pytest.mark.parametrize("off_m", [-0.3, -0.1, 0.1, 0.327, 0.6])
def test_the_other_camera_s_first_look_finds_what_one_saw_alone(off_m: float):
    """Test: a landmark at .5 m, off along the first camera's ray, as unsure as that.

    Expected: it is where the rays meet; one linearisation alone leaves it up to .6 m off.
    """
    cameras = extrinsics(tuple(SyntheticRig().rig().values()))
    place, axes = np.array([0.03, -0.02, 0.5]), (SIZE - 1) // 3
    eye = -cameras.R[0].T @ cameras.t[0]
    way = (place - eye) / np.linalg.norm(place - eye)
    x, P = np.zeros(SIZE), 1e-12 * np.eye(SIZE)
    first = 3 * LANDMARK
    x[first : first + 3] = place + off_m * way
    P[first : first + 3, first : first + 3] = 1e-8 * np.eye(3) + off_m**2 * np.outer(way, way)
    seen = cameras.R[1] @ place + cameras.t[1]
    look = Look(LANDMARK, 0.0, seen[:2] / seen[2], 1e-8, cameras.R[1], cameras.t[1])
    taken, innovation = np.empty((2, SIZE)), empty()
    assert innovate(x, P, taken, 0, look, innovation) > 0.0
    linearise_where_it_leads(x, P, taken, 0, look, innovation)
    take(x, taken, 0, innovation)
    assert np.linalg.norm(x[first : first + 3] - place) < 5e-3
    assert not x[axes:].any()


def test_a_straight_ray_is_not_linearised_anew(look, state):
    x, P = state
    look = look._replace(ray_variance=1.0)
    before, after = empty(), empty()
    innovate(x, P, *NONE_TAKEN, look, before)
    innovate(x, P, *NONE_TAKEN, look, after)
    linearise_where_it_leads(x, P, *NONE_TAKEN, look, after)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_a_state_that_is_no_state_ends_all_the_same(look, state, value: float):
    x, P = state
    P[3 * LANDMARK : 3 * LANDMARK + 3] = value
    innovation = empty()
    innovate(x, P, *NONE_TAKEN, look, innovation)
    linearise_where_it_leads(x, P, *NONE_TAKEN, look, innovation)


def test_what_is_behind_the_camera_gives_no_innovation(look, state):
    x, P = state
    x[3 * LANDMARK + 2] = -0.5
    assert not innovate(x, P, *NONE_TAKEN, look, empty()) > 0.0


def test_adjoint_is_the_dense_one(look, state):
    x, P = state
    innovation = empty()
    new_x, new_P = x.copy(), P.copy()
    innovate(new_x, new_P, *NONE_TAKEN, look, innovation)
    take(new_x, np.empty((2, SIZE)), 0, innovation)
    H = dense_jacobian(innovation)
    random = np.random.default_rng(2)
    factor = random.normal(size=(SIZE, SIZE))
    adjoint, information = random.normal(size=SIZE), factor @ factor.T
    left = np.eye(SIZE) - innovation.K.T @ H
    expected = left.T @ adjoint - H.T @ innovation.S_inverse @ innovation.nu
    expected_information = left.T @ information @ left + H.T @ innovation.S_inverse @ H
    rows = np.empty((SIZE + 3, SIZE))
    rows[0], rows[1 : SIZE + 1] = adjoint, factor.T
    known = adjoint_update(rows, SIZE + 1, LANDMARK, DELAY_S, innovation)
    assert known == SIZE + 3
    scale = np.abs(expected_information).max()
    np.testing.assert_allclose(rows[0], expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(rows[1:].T @ rows[1:], expected_information, atol=1e-10 * scale)
