"""The 1-Euro filter against its authors' reference data, and its laws."""

from __future__ import annotations

import csv

import numpy as np

from rhot.geometry.transforms import rotation_from_vector
from services.fusion.paired.one_euro import OneEuroFilter


def test_reproduces_the_reference_data(rhot_data):
    with (rhot_data / "oneeuro" / "groundTruth.csv").open() as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    one_euro = OneEuroFilter(1.0, 0.1, 1.0)
    worst = max(abs(float(one_euro(row["noisy"], 1.0 / 120.0)) - row["filtered"]) for row in rows)
    assert len(rows) == 1200
    # Upstream's tolerance is 1e-4; the file itself is rounded to 6 digits.
    assert worst < 3e-5


def test_joint_filter_commutes_with_rotation():
    random = np.random.default_rng(0)
    R = rotation_from_vector([0.4, -0.8, 0.3])
    plain, turned = (
        OneEuroFilter(3.0, 30.0, 1.0, joint=True),
        OneEuroFilter(3.0, 30.0, 1.0, joint=True),
    )
    for point in random.normal(0.0, 0.1, (50, 3)):
        np.testing.assert_allclose(turned(R @ point, 1 / 30), R @ plain(point, 1 / 30), atol=1e-12)


def test_rest_is_calm_and_motion_is_prompt():
    random = np.random.default_rng(1)
    calm = OneEuroFilter(1.0, 30.0, 1.0)
    still = np.array([float(calm(value, 1 / 60)) for value in random.normal(0.0, 1e-3, 600)])
    assert still[60:].std() < 0.5e-3
    moving = [float(calm(0.5 * k / 60, 1 / 60)) for k in range(120)]
    # At 0.5 m/s the cutoff is 16 Hz: 10 ms of lag are 5 mm.
    assert abs(moving[-1] - 0.5 * 119 / 60) < 6e-3


def test_time_that_stands_still_changes_nothing_and_reset_forgets():
    one_euro = OneEuroFilter(1.0, 0.1, 1.0)
    first = one_euro([1.0, 2.0], 0.1)
    np.testing.assert_array_equal(one_euro([5.0, 5.0], 0.0), first)
    np.testing.assert_array_equal(one_euro([5.0, 5.0], -1.0), first)
    one_euro.reset()
    np.testing.assert_array_equal(one_euro([5.0, 5.0], 0.1), [5.0, 5.0])
