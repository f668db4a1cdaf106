"""A landmark that one camera sees alone is told by the shape that its hand had."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_y
from services.fusion.one_camera.carried_shape import carry_shape, no_shapes, note_shapes
from services.fusion.one_camera.kept_shape import empty_memory

PLACES = np.array([[0.0, 0.09, 0.6], [-0.07, 0.02, 0.6], [-0.03, -0.05, 0.59], [0.05, -0.03, 0.61]])
SURE = 1e-6 * np.eye(3)
HIDDEN, SPAN_S = 3, 1.0 / 30.0
HAND = np.zeros(4, dtype=np.int64)
ALL = np.ones(4, dtype=np.bool_)
LOCATED = np.array([True, True, True, False])


def carried(age_s, located=LOCATED):
    """A hand moved and turned, of one landmark only its ray known: truth, place, covariance."""
    memory, shapes = empty_memory(4, np.zeros(3)), no_shapes(4)
    memory.deformed[:] = 0.0005**2
    note_shapes(shapes, ALL, PLACES, np.tile(SURE, (4, 1, 1)), 1.0)
    truth = PLACES @ rotation_y(0.2).T + [0.02, -0.01, 0.05]
    ray = truth[HIDDEN] / np.linalg.norm(truth[HIDDEN])
    now, covs = truth.copy(), np.tile(SURE, (4, 1, 1))
    now[HIDDEN] += 0.1 * ray
    covs[HIDDEN] += 0.3**2 * np.outer(ray, ray)
    out = np.full(3, np.nan), np.full((3, 3), np.nan)
    are, lately = (located, ~LOCATED), (memory, SPAN_S)
    told = carry_shape(shapes, lately, HAND, HIDDEN, are, (1.0 + age_s, now, covs), out)
    return told, truth[HIDDEN], *out


@pytest.mark.parametrize("age_s", [0.05, 0.3, 2.0])
def test_the_shape_tells_the_distance_and_how_far_it_may_be_trusted(age_s):
    told, truth, place, cov = carried(age_s)
    assert told
    assert np.linalg.norm(place - truth) < 0.006  # its ray alone was 100 mm off
    sigma_m = float(np.sqrt(np.linalg.eigvalsh(cov)[2]))
    assert np.linalg.norm(place - truth) < 3.0 * sigma_m < 0.2


def test_it_is_less_sure_the_older_the_shape_is():
    sigmas = [np.sqrt(np.linalg.eigvalsh(carried(age_s)[3])[2]) for age_s in (0.05, 0.2, 1.0)]
    assert sigmas == sorted(sigmas)


def test_without_a_shape_or_with_too_few_landmarks_nothing_is_told():
    assert not carried(0.1, located=np.array([True, False, False, False]))[0]
    assert not carried(-0.1)[0]
