"""Two poses of one hand: when the other takes over, when it is given up, what is told meanwhile."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector
from services.solver.whole_hand.hand_estimate import HandEstimate, offset
from services.solver.whole_hand.rival import Rival, same_pose

FRAME_S = 1.0 / 30.0
OWN = HandEstimate(np.eye(3), np.zeros(3), np.full((5, 4), 0.3), 1e-4 * np.eye(26), 10.0, 4)
TURN = np.array([0.0, 0.0, 1.0])
OTHER = OWN._replace(rotation=rotation_from_vector(TURN))


def _followed(messages: int, own_cost: float, other_cost: float) -> Rival:
    rival = Rival(OTHER, 0.0, 0.0)
    for _ in range(messages):
        rival = rival.after(OWN._replace(cost=own_cost), OTHER._replace(cost=other_cost), FRAME_S)
    return rival


def test_a_clearly_better_rival_wins_but_not_with_one_message() -> None:
    assert not _followed(2, 1e4, 10.0).has_won()
    assert _followed(9, 1e4, 10.0).has_won()
    assert not _followed(300, 12.0, 10.0).has_won()


def test_a_worse_rival_is_given_up() -> None:
    assert _followed(3, 10.0, 30.0).is_over(OWN)
    assert not _followed(300, 10.0, 10.0).is_over(OWN)


def test_a_rival_that_became_the_pose_is_over() -> None:
    near = OWN._replace(rotation=rotation_from_vector(0.1 * TURN))
    assert same_pose(OWN, near)
    assert Rival(near, 0.0, 0.0).is_over(OWN)
    bent = OWN.angles_rad.copy()
    bent[4, 1] += 0.5
    assert not same_pose(OWN, OWN._replace(angles_rad=bent))


@pytest.mark.parametrize(("odds", "share"), [(0.0, 0.5), (-np.log(3.0), 0.25)])
def test_the_share_of_the_rival_is_in_the_covariance(odds: float, share: float) -> None:
    told = Rival(OTHER, odds, 0.0).told(OWN)
    np.testing.assert_array_equal(told.rotation, OWN.rotation)
    np.testing.assert_allclose(offset(OWN, OTHER)[:3], TURN)
    np.testing.assert_allclose(np.diag(told.covariance)[:3], [1e-4, 1e-4, 1e-4 + share])
