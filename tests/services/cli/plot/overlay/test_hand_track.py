"""The hand at any instant: between two poses, at the ends, and not in gaps."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from services.cli.plot.overlay.hand_track import HandTrack

MS = 1_000_000


@pytest.fixture(scope="module")
def poses(made_up):
    """30 Hz for two seconds with a gap of a third of a second in the middle."""
    times = [k / 30 for k in range(60) if not 25 <= k < 35]
    return [made_up.pose(t) for t in times]


def test_between_two_poses_the_hand_is_where_it_was(made_up, poses):
    track = HandTrack(poses, 80 * MS)
    for t_s in (0.1, 0.15, 0.21, 0.5):
        (hand,) = track.at(made_up.pose(t_s).stamp_ns)
        truth = made_up.pose(t_s)
        off_mm = 1e3 * (hand.joints_m - [joint.position_m for joint in truth.joints])
        # What a straight line over 33 ms leaves of this motion.
        assert np.linalg.norm(off_mm, axis=1).max() < 0.6
        angles = [finger.model_angles_rad for finger in truth.fingers]
        assert np.rad2deg(np.abs(hand.angles_rad - angles)).max() < 0.3
        assert abs(hand.pose.stamp_ns - truth.stamp_ns) <= 17 * MS


def test_there_is_no_hand_in_a_gap_and_before_the_first_pose(made_up, poses):
    track = HandTrack(poses, 80 * MS)
    first_ns = poses[0].stamp_ns
    assert track.at(first_ns - 60 * MS) == []
    assert len(track.at(first_ns - 30 * MS)) == 1
    assert len(track.at(made_up.pose(24 / 30).stamp_ns + 30 * MS)) == 1
    assert track.at(made_up.pose(30 / 30).stamp_ns) == []
    assert len(track.at(made_up.pose(40 / 30).stamp_ns)) == 1
    assert track.at(poses[-1].stamp_ns + 100 * MS) == []


def test_two_hands_do_not_disturb_each_other(poses):
    other = [msgspec.structs.replace(one, hand="left", stamp_ns=one.stamp_ns + 7) for one in poses]
    both = sorted([*poses, *other], key=lambda pose: pose.stamp_ns)
    hands = HandTrack(both, 80 * MS).at(poses[10].stamp_ns + 5 * MS)
    assert [hand.hand for hand in hands] == ["left", "right"]
    assert hands[0].joints_m == pytest.approx(hands[1].joints_m, abs=1e-6)
