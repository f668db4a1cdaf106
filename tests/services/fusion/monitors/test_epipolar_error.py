"""The height difference of a landmark in two cameras: by clock, by motion, or none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import rectified_pair
from services.fusion.intake.ray_interpolation import add_frame, no_tracks
from services.fusion.monitors.epipolar_error import EpipolarErrors, epipolar_errors
from testing.synthetic_points import SyntheticRig

PERIOD_S = 1.0 / 30.0
CAMERAS = tuple(SyntheticRig(distortion=(0.0,) * 5).rig().values())
PAIR = rectified_pair(*CAMERAS)


Samples = list[tuple[float, Array]]  # times, rays (2,)


def track(camera: int, speed_m_s: float, late_s: float = 0.0, frames: int = 10) -> Samples:
    """A landmark at 0.7 m that moves down, in a camera whose stamps are late."""
    made = []
    for k in range(frames):
        time_s = (k + 0.5 * camera) * PERIOD_S
        p = np.array([0.0375, speed_m_s * time_s, 0.7]) - CAMERAS[camera].centre_rig
        made.append((time_s + late_s, p[:2] / p[2]))
    return made


class Error(NamedTuple):
    """One landmark's, of EpipolarErrors."""

    time_s: float
    height: float
    speed: float
    span_s: float
    variance: float


def errors_of(
    first: Samples, second: Samples, shift_s: float = 0.0, sigma: float = 1e-4, compared_s=np.nan
) -> EpipolarErrors:
    """Of the second of two landmarks, the other of which is not seen."""
    tracks = no_tracks(2, 2)
    for camera, samples in enumerate((first, second)):
        for time_s, ray in samples:
            frame = np.array([1]), np.array([time_s]), ray[None, :], np.array([sigma])
            add_frame(tracks, camera, *frame)
    compared = np.array([np.nan, compared_s])
    found = epipolar_errors(PAIR, tracks, (0, 1), shift_s, PERIOD_S, compared)
    assert found.times_s.tolist() == compared[1:].tolist() or not len(found.landmarks)
    return found


def error_of(first: Samples, second: Samples, shift_s: float = 0.0, sigma: float = 1e-4) -> Error:
    """The only error that there is."""
    landmarks, *columns = errors_of(first, second, shift_s, sigma)
    assert landmarks.tolist() == [1]
    return Error(*(float(column[0]) for column in columns))


@pytest.mark.parametrize("late_s", [0.0, 0.004])
def test_a_late_clock_shifts_the_height_by_what_the_landmark_moves(late_s):
    error = error_of(track(0, 0.5), track(1, 0.5, late_s))
    assert error.speed == pytest.approx(0.5 / 0.7)
    assert error.height == pytest.approx(late_s * error.speed, abs=1e-9)
    known = error_of(track(0, 0.5), track(1, 0.5, late_s), late_s)
    assert known.height == pytest.approx(0.0, abs=1e-9)


def test_a_still_landmark_has_no_speed_and_both_rays_variances():
    error = error_of(track(0, 0.0), track(1, 0.0))
    assert error.speed == 0.0
    assert 1e-8 < error.variance < 2.1e-8


def test_what_interpolation_may_miss_is_in_the_variance():
    calm = error_of(track(0, 0.5), track(1, 0.5))
    turned = track(1, 0.5)
    # The newest that is compared lies between the two samples about a sharp turn.
    for k, height in ((10, 0.250), (11, 0.226), (12, 0.202)):
        turned.append(((k + 0.5) * PERIOD_S, np.array([0.0, height])))
    first = track(0, 0.5, frames=13)
    assert error_of(first, turned).variance > 10.0 * calm.variance


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_does_not_pass_for_a_late_clock(seed):
    """Errors of 2 px that nobody announces: the speed shares none of them with the height."""
    random = np.random.default_rng(seed)
    products, squares = [], []
    for _ in range(400):
        noisy = []
        for camera in (0, 1):
            made = []
            for k in range(10):
                ray = np.array([0.0, 0.1]) + random.normal(0.0, 2.0 / 550.0, 2)
                made.append(((k + 0.2 * camera) * PERIOD_S, ray))
            noisy.append(made)
        error = error_of(*noisy, sigma=1e-6)
        products.append(error.height * error.speed)
        squares.append(error.speed**2)
    assert abs(np.sum(products) / np.sum(squares)) < 0.1 * PERIOD_S


def test_tracks_that_do_not_overlap_by_four_samples_give_none():
    assert not len(errors_of(track(0, 0.5), track(1, 0.5, frames=3)).landmarks)
    assert not len(errors_of([], track(1, 0.5)).landmarks)


def test_an_instant_is_compared_once():
    known_s = error_of(track(0, 0.5), track(1, 0.5)).time_s
    assert not len(errors_of(track(0, 0.5), track(1, 0.5), compared_s=known_s).landmarks)
    assert len(errors_of(track(0, 0.5), track(1, 0.5), compared_s=known_s - PERIOD_S).landmarks)
