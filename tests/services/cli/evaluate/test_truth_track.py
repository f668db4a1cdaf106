"""The truth at instants between its lines, and truth that cannot be used."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from services.cli.evaluate.truth_track import hand_track, inside, object_track


def test_a_hand_between_two_lines_is_the_hand_of_that_instant(made_up):
    track = hand_track(made_up.truths(), "right")
    at = made_up.truth(1.2345)
    found = track.at(np.array([at.stamp_ns], dtype=np.int64))
    truth = at.hands["right"]
    assert np.allclose(found.wrist_m[0], truth.wrist.position_m, atol=2e-5)
    assert np.allclose(found.tips_m[0, 1], truth.points_m["index_tip"], atol=1e-4)
    assert np.allclose(found.angles_rad[0, 1, 1], truth.angles_rad["index"].mcp, atol=2e-3)


def test_instants_outside_the_truth_are_known(made_up):
    track = hand_track(made_up.truths(), "right")
    first, last = track.stamps_ns[0], track.stamps_ns[-1]
    assert inside(track, np.array([first - 1, first, last, last + 1])).tolist() == [
        False,
        True,
        True,
        False,
    ]


def test_too_little_truth_or_two_lines_of_one_instant_is_an_error(made_up):
    lines = made_up.truths(0.1)
    with pytest.raises(CaptureError, match="at least 2"):
        hand_track(lines[:1], "right")
    with pytest.raises(CaptureError, match="left hand: 0 line"):
        hand_track(lines, "left")
    with pytest.raises(CaptureError, match="same stamp_ns"):
        hand_track([lines[0], lines[0]], "right")
    with pytest.raises(CaptureError, match="'fork'"):
        object_track(lines, "fork")
