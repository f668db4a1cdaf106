"""The Kalman method in FusionStep: exact, honest, and calm with missing and wild markers."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from testing.point_errors import point_errors
from testing.synthetic_points import MovingHand, RestingHand, SyntheticRig, frames


@pytest.mark.parametrize(("lag_frames", "rms_mm"), [(0, 2.5), (1, 1.0), (2, 0.95)])
def test_a_moving_hand(run, lag_frames, rms_mm):
    fusion = Fusion(lag_frames=lag_frames)
    _, errors = run(SyntheticRig(), MovingHand(), fusion)
    assert errors.rms_mm < rms_mm
    assert 0.5 < errors.nees < 1.5


def test_a_resting_hand_is_averaged(run):
    _, errors = run(SyntheticRig(), RestingHand(), Fusion())
    assert errors.depth_rms_mm < 0.85
    assert 0.5 < errors.nees < 1.5


def test_a_fifth_of_the_markers_missing_costs_little(fuse):
    """Test: a fifth of all markers is missing, each by itself.

    Expected: every landmark is told in every message after the start.
    """
    random = np.random.default_rng(1)
    given = [
        msgspec.structs.replace(
            frame, markers=[marker for marker in frame.markers if random.random() > 0.2]
        )
        for frame in frames(SyntheticRig(), MovingHand(), 5.0)
    ]
    _, messages = fuse(SyntheticRig(), given, Fusion(lag_frames=2))
    assert all(len(message.points) == 6 for message in messages[30:-3])
    assert point_errors(messages, MovingHand()).within(1.0).rms_mm < 2.3


def test_two_runs_are_the_same(fuse):
    given = frames(SyntheticRig(), MovingHand(), 1.0)
    fusion = Fusion(lag_frames=1)
    assert fuse(SyntheticRig(), given, fusion)[1] == fuse(SyntheticRig(), given, fusion)[1]
