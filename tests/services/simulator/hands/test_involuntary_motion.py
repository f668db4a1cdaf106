"""Involuntary motion: of the right size, inside the limits, the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import default_hand
from services.simulator.hands.gestures import MOTIONS
from services.simulator.hands.involuntary_motion import InvoluntaryMotion


def test_the_hand_sways_a_little_and_never_stops():
    sway = InvoluntaryMotion(1)
    shifts = np.array([sway(t)[1] for t in np.arange(0.0, 20.0, 0.01)])
    turns = np.array([sway(t)[0] for t in np.arange(0.0, 20.0, 0.01)])
    assert 0.3e-3 < np.linalg.norm(shifts, axis=1).mean() < 4e-3
    assert 0.05 < np.rad2deg(np.linalg.norm(turns, axis=1).mean()) < 2.0
    speed = np.linalg.norm(np.diff(shifts, axis=0), axis=1) / 0.01
    assert 1e-3 < speed.mean() < 30e-3


@pytest.mark.parametrize("name", ["still", "fist"])
def test_fingers_sway_a_little_inside_their_limits(name):
    """Test: an open hand, and one that closes to near its limits.

    Expected: tenths of a degree, coupled, the same every time.
    """
    model = default_hand("right")
    meant, sway = MOTIONS[name](model, 1), InvoluntaryMotion(1)
    times_s = np.arange(0.0, 20.0, 0.02)
    angles = np.array([sway.fingers(t, meant(t).angles_rad, model) for t in times_s])
    off = angles - np.array([meant(t).angles_rad for t in times_s])
    movable = np.ptp(model.limits_rad, axis=-1) > 0.0
    assert (angles >= model.limits_rad[..., 0]).all()
    assert (angles <= model.limits_rad[..., 1]).all()
    assert np.rad2deg(off[..., movable].std(axis=0)).min() > 0.02
    assert np.rad2deg(np.abs(off).max()) < 0.5
    np.testing.assert_allclose(off[:, 1:, 3], off[:, 1:, 2] * model.digits[1].coupling, atol=2e-3)
    np.testing.assert_array_equal(
        angles[7], InvoluntaryMotion(1).fingers(times_s[7], meant(times_s[7]).angles_rad, model)
    )
