"""A landmark that one camera sees alone: its ray is kept, its distance hardly moves."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.method import no_estimates
from services.fusion.one_camera.last_located import LastLocated

CENTRE = np.array([0.1, 0.0, 0.0])
PLACE = np.array([0.0, 0.05, 0.5])
# Of the filter: a millimetre across, 0.4 m along the ray.
RAY = (PLACE - CENTRE) / np.linalg.norm(PLACE - CENTRE)
COV = 1e-6 * np.eye(3) + 0.16 * np.outer(RAY, RAY)


def located(time_s=1.0):
    last = LastLocated(np.zeros(2, dtype=np.int64), CENTRE, 1.0 / 60.0)
    estimates = no_estimates(2, 2)
    estimates.found[0] = estimates.measured[0] = True
    estimates.positions_m[:], estimates.covariances_m2[:] = PLACE, COV
    last.take(time_s, estimates)
    last.settle()
    return last


@pytest.mark.parametrize("drift", [-0.6, 0.3, 3.0])
def test_the_ray_is_kept_and_the_distance_is_the_last_one(drift):
    estimate = CENTRE + (1.0 + drift) * (PLACE - CENTRE), COV
    position, cov = located().told(0, 1.6, estimate, CENTRE)
    assert np.linalg.norm(np.cross(position - CENTRE, RAY)) < 1e-12
    assert np.linalg.norm(position - PLACE) < 0.05
    # As unsure along the ray as a hand of which nothing is known, and across it as an angle is at
    # that distance.
    sigma_m = np.sqrt(np.linalg.eigvalsh(cov))
    assert 0.05 < sigma_m[2] < 0.09
    assert np.allclose(sigma_m[:2], 1e-3 / (1.0 + drift), rtol=0.15)


def test_the_filter_counts_while_it_knows_better():
    moved = PLACE + 0.01 * RAY
    near = 1e-6 * np.eye(3)
    position, cov = located().told(0, 1.02, (moved, near), CENTRE)
    assert np.linalg.norm(position - moved) < 2e-3
    assert np.sqrt(np.linalg.eigvalsh(cov)[2]) < 2e-3


def test_what_two_cameras_never_saw_is_told_as_the_filter_has_it():
    for place, cov in (
        located().told(1, 1.1, (PLACE, COV), CENTRE),
        located(time_s=2.0).told(0, 1.0, (PLACE, COV), CENTRE),
    ):
        assert np.array_equal(place, PLACE)
        assert np.array_equal(cov, COV)


@pytest.mark.parametrize(("swing_m", "least_m", "most_m"), [(0.0, 0.01, 0.04), (0.1, 0.08, 0.15)])
def test_the_distance_is_as_unsure_as_the_hand_lately_moved(swing_m, least_m, most_m):
    last = LastLocated(np.zeros(1, dtype=np.int64), CENTRE, 1.0 / 60.0)
    estimates = no_estimates(1, 2)
    estimates.found[0] = estimates.measured[0] = True
    for k in range(300):
        place = PLACE + swing_m * np.sin(4.0 * k / 60.0) * RAY
        estimates.positions_m[0], estimates.covariances_m2[0] = place, COV
        last.take(1.0 + k / 60.0, estimates)
        last.settle()
    _, cov = last.told(0, 1.0 + 299 / 60.0 + 0.5, (place, COV), CENTRE)
    assert least_m < np.sqrt(np.linalg.eigvalsh(cov)[2]) < most_m
