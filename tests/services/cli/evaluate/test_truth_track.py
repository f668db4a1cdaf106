"""Interpolation of the truth against functions known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.errors import CaptureError
from rhot.geometry.transforms import (
    angle_between,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from services.cli.evaluate.interpolation import cubic, linear, slerp
from services.cli.evaluate.truth_track import hand_track, inside, object_track

STAMPS = 1_700_000_000_000_000_000 + np.arange(31, dtype=np.int64) * 33_333_333


def test_cubic_follows_a_motion_to_a_hundredth_of_a_millimetre():
    at = STAMPS[2:-3] + 14_000_000
    seconds = (STAMPS - STAMPS[0]) * 1e-9
    found = cubic(STAMPS, 0.1 * np.sin(6.0 * seconds)[:, None], at)
    assert np.abs(found[:, 0] - 0.1 * np.sin(6.0 * (at - STAMPS[0]) * 1e-9)).max() < 1e-5


def test_linear_is_exact_on_a_line_and_keeps_trailing_shape():
    seconds = (STAMPS - STAMPS[0]) * 1e-9
    values = np.stack([seconds, -2.0 * seconds], axis=1).reshape(-1, 2, 1) * np.ones((1, 2, 4))
    at = np.array([STAMPS[0], STAMPS[3] + 1_000_000, STAMPS[-1]])
    found = linear(STAMPS, values, at)
    assert found.shape == (3, 2, 4)
    assert np.allclose(found[:, 0, 0], (at - STAMPS[0]) * 1e-9, atol=1e-12)


@given(st.floats(0.0, 1.0), st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_slerp_goes_the_shortest_way_at_constant_speed(share, vectors):
    a, b = rotation_from_vector(vectors[:3]), rotation_from_vector(vectors[3:])
    stamps = np.array([0, 10**9], dtype=np.int64)
    q = np.array([quaternion_from_rotation(a), -quaternion_from_rotation(b)])
    found = slerp(stamps, q, np.array([round(share * 1e9)], dtype=np.int64))[0]
    assert np.isclose(np.linalg.norm(found), 1.0)
    assert found[0] >= 0.0
    whole, part = angle_between(a, b), angle_between(a, rotation_from_quaternion(found))
    # At 180 deg both ways are the shortest.
    assert np.isclose(part, round(share * 1e9) * 1e-9 * whole, atol=1e-5)


def test_a_hand_between_two_lines_is_the_hand_of_that_instant(made_up):
    track = hand_track(made_up.truths(), "right")
    at = made_up.truth(1.2345)
    found = track.at(np.array([at.stamp_ns], dtype=np.int64))
    truth = at.hands["right"]
    assert np.allclose(found.wrist_m[0], truth.wrist.position_m, atol=2e-5)
    assert np.allclose(found.tips_m[0, 1], truth.points_m["index_tip"], atol=1e-4)
    assert np.allclose(found.angles_rad[0, 1, 1], truth.angles_rad["index"].mcp, atol=2e-3)


def test_instants_outside_the_truth_are_told(made_up):
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
