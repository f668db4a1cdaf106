"""What was out of view, of both cameras or of one, and is back: what is told of it is true."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from testing.point_errors import point_errors
from testing.synthetic_points import COLORS, START_NS, MovingHand, SyntheticRig, frames

# Everything is gone from both cameras for so long; what is told in the first EARLY_S is looked at.
GONE_S, BACK_S, EARLY_S = 1.5, 1.9, 0.1
# Three tips are hidden from the right camera for so long.
HIDDEN, BEGIN_S, END_S = COLORS[2:5], 1.5, 2.0


@pytest.mark.parametrize("seed", [1, 2, 3, 31])
@pytest.mark.parametrize(("lag_frames", "rms_mm"), [(0, 14.0), (2, 3.5)])
def test_a_moving_hand_that_is_back(fuse, lag_frames, rms_mm, seed):
    """Rays of its first two looks meet decimetres off, and how it moved before says nothing."""
    setup, hand, given = SyntheticRig(), MovingHand(seed=seed), []
    for frame in frames(setup, hand, 3.0):
        at_s = 1e-9 * (frame.stamp_ns - frame.clock_offset_ns - START_NS)
        gone = GONE_S <= at_s < BACK_S
        given.append(msgspec.structs.replace(frame, markers=[]) if gone else frame)
    _, messages = fuse(setup, given, Fusion(lag_frames=lag_frames))
    early = point_errors(messages, hand).within(BACK_S, BACK_S + EARLY_S)
    assert early.rms_mm < rms_mm
    assert early.nees < 3.0
    assert np.isfinite(early.errors_m).all()
    assert len(early.errors_m) >= 6


@pytest.mark.parametrize("seed", [1, 2, 3, 5, 8])
def test_looks_after_a_fresh_start_measure_nothing_before_it(fuse, seed):
    """Two frames of lag: a track that contradicts the second camera's looks starts anew with them.
    They say nothing of the instants before, which are told as one camera's.
    """
    setup, hand, given = SyntheticRig(), MovingHand(seed=seed), []
    for frame in frames(setup, hand, 3.0):
        at_s = 1e-9 * (frame.stamp_ns - START_NS)
        if frame.camera == "right" and BEGIN_S <= at_s < END_S:
            shown = [marker for marker in frame.markers if marker.color not in HIDDEN]
            frame = msgspec.structs.replace(frame, markers=shown)
        given.append(frame)
    _, messages = fuse(setup, given, Fusion(lag_frames=2))
    around = point_errors(messages, hand).within(BEGIN_S, END_S + 0.1)
    errors_m = np.linalg.norm(around.errors_m[around.measured], axis=1)
    assert errors_m.size > 50
    assert errors_m.max() < 0.015
