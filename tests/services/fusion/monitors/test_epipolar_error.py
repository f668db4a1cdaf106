"""The height difference of a landmark in two cameras: by clock, by motion, or none."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.rectified_pair import rectified_pair
from services.fusion.intake.ray_interpolation import RayTrack
from services.fusion.monitors.epipolar_error import epipolar_error
from testing.synthetic_points import SyntheticRig

PERIOD_S = 1.0 / 30.0
CAMERAS = tuple(SyntheticRig(distortion=(0.0,) * 5).rig().values())
PAIR = rectified_pair(*CAMERAS)


def track(camera: int, speed_m_s: float, late_s: float = 0.0, frames: int = 10) -> RayTrack:
    """A landmark at 0.7 m that moves down, in a camera whose stamps are late."""
    made = RayTrack()
    for k in range(frames):
        time_s = (k + 0.5 * camera) * PERIOD_S
        p = np.array([0.0375, speed_m_s * time_s, 0.7]) - CAMERAS[camera].centre_rig
        made.add(time_s + late_s, p[:2] / p[2], 1e-4)
    return made


@pytest.mark.parametrize("late_s", [0.0, 0.004])
def test_a_late_clock_shifts_the_height_by_what_the_landmark_moves(late_s):
    error = epipolar_error(PAIR, track(0, 0.5), track(1, 0.5, late_s), 0.0, PERIOD_S)
    assert error.speed == pytest.approx(0.5 / 0.7)
    assert error.height == pytest.approx(late_s * error.speed, abs=1e-9)
    known = epipolar_error(PAIR, track(0, 0.5), track(1, 0.5, late_s), late_s, PERIOD_S)
    assert known.height == pytest.approx(0.0, abs=1e-9)


def test_a_still_landmark_has_no_speed_and_both_rays_variances():
    error = epipolar_error(PAIR, track(0, 0.0), track(1, 0.0), 0.0, PERIOD_S)
    assert error.speed == 0.0
    assert 1e-8 < error.variance < 2.1e-8


def test_what_interpolation_may_miss_is_in_the_variance():
    calm = epipolar_error(PAIR, track(0, 0.5), track(1, 0.5), 0.0, PERIOD_S)
    turned = track(1, 0.5)
    # The newest that is compared lies between the two samples about a sharp turn.
    for k, height in ((10, 0.250), (11, 0.226), (12, 0.202)):
        turned.add((k + 0.5) * PERIOD_S, np.array([0.0, height]), 1e-4)
    first = track(0, 0.5, frames=13)
    assert epipolar_error(PAIR, first, turned, 0.0, PERIOD_S).variance > 10.0 * calm.variance


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_does_not_pass_for_a_late_clock(seed):
    """Errors of 2 px that nobody announces: the speed shares none of them with the height."""
    random = np.random.default_rng(seed)
    products, squares = [], []
    for _ in range(400):
        noisy = []
        for camera in (0, 1):
            made = RayTrack()
            for k in range(10):
                ray = np.array([0.0, 0.1]) + random.normal(0.0, 2.0 / 550.0, 2)
                made.add((k + 0.2 * camera) * PERIOD_S, ray, 1e-6)
            noisy.append(made)
        error = epipolar_error(PAIR, *noisy, 0.0, PERIOD_S)
        products.append(error.height * error.speed)
        squares.append(error.speed**2)
    assert abs(np.sum(products) / np.sum(squares)) < 0.1 * PERIOD_S


def test_tracks_that_do_not_overlap_by_four_samples_give_none():
    assert epipolar_error(PAIR, track(0, 0.5), track(1, 0.5, frames=3), 0.0, PERIOD_S) is None
    assert epipolar_error(PAIR, RayTrack(), track(1, 0.5), 0.0, PERIOD_S) is None
