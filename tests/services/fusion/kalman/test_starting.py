"""Where a landmark begins: rays of different instants, of something that moves."""

from __future__ import annotations

import numpy as np

from services.fusion.geometry.projection import extrinsics
from services.fusion.kalman.starting import Looks, fit_start
from testing.synthetic_points import SyntheticRig

CAMERAS = extrinsics(tuple(SyntheticRig().rig().values()))


def looks_at(path, seconds: float = 0.1) -> Looks:
    """Two cameras' looks at a path, a sixtieth of a second apart."""
    times = np.arange(0.0, seconds, 1 / 60.0)
    rays = []
    for n, time_s in enumerate(times):
        q = CAMERAS.R[n % 2] @ path(time_s) + CAMERAS.t[n % 2]
        rays.append(q[:2] / q[2])
    each = np.full(len(times), 1e-8)
    return Looks(times, np.arange(len(times)) % 2, np.array(rays), each, np.zeros(len(times)))


def test_a_moving_landmark_begins_where_it_was():
    velocity, acceleration = np.array([0.8, -0.4, 0.5]), np.array([3.0, 5.0, -4.0])

    def path(time_s):
        start = np.array([0.05, 0.02, 0.6])
        return start + velocity * time_s + 0.5 * acceleration * time_s**2

    start = fit_start(looks_at(path), CAMERAS, 2.0, np.zeros(3))
    assert start is not None
    assert start.residual < 1.0
    np.testing.assert_allclose(start.motion[:3], path(0.0), atol=3e-3)
    np.testing.assert_allclose(start.motion[3:6], velocity, atol=0.15)


def test_looks_of_one_camera_begin_nothing():
    looks = looks_at(lambda _: np.array([0.0, 0.0, 0.6]))
    alone = Looks(*(column[::2] for column in looks))
    assert fit_start(alone, CAMERAS, 2.0, np.zeros(3)) is None


def test_looks_of_two_things_do_not_agree():
    looks = looks_at(lambda _: np.array([0.0, 0.0, 0.6]))
    ray = looks.ray.copy()
    ray[1::2, 1] += 0.1
    start = fit_start(looks._replace(ray=ray), CAMERAS, 2.0, np.zeros(3))
    assert start is None or start.residual > 10.0
