"""Located landmarks as messages: rounded, by hand, without what is of no use."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from rhot.hand import HANDS
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import Landmark
from services.fusion.method import Estimates
from services.fusion.output.hand_points import Corrections, PointMessages
from services.fusion.output.systematic_error import Systematic
from services.fusion.paint.hidden_paint import HiddenPaint, PaintSeen
from services.fusion.paint.paint_to_bone import PaintToBone
from testing.synthetic_points import SyntheticRig, point_hands

CAMERAS = tuple(SyntheticRig().rig().values())
LANDMARKS = (
    Landmark("left", "wrist"),
    Landmark("left", "index_tip"),
    Landmark("right", "wrist"),
    Landmark("right", "index_tip"),
)
NOTHING = Systematic(np.zeros(4), np.full(2, 1e-4), np.zeros(4, dtype=bool))
# Of points without extent.
PAINT = PaintToBone(LANDMARKS, dict.fromkeys(HANDS, point_hands()["right"]), CAMERAS).known


@pytest.fixture
def seen() -> PaintSeen:
    return HiddenPaint(extrinsics(CAMERAS), np.zeros(4, dtype=bool), PAINT).seen


@pytest.fixture
def messages(seen: PaintSeen) -> PointMessages:
    reach_m = {"left": 0.19, "right": 0.19}
    known = Corrections(PAINT, NOTHING, seen, extrinsics(CAMERAS), np.zeros((2, 3)))
    return PointMessages(LANDMARKS, reach_m, ["near", "far"], known)


def estimates(positions: Array) -> Estimates:
    return Estimates(
        found=np.array([True, True, False, True]),
        positions_m=positions,
        covariances_m2=np.tile(4e-6 * np.eye(3), (4, 1, 1)),
        seen_by=np.array([[True, True], [True, False], [False, False], [False, True]]),
        measured=np.array([True, False, False, False]),
        detected=np.array([True, True, False, False]),
    )


@pytest.fixture
def positions() -> Array:
    return np.array([[0.0123456789, 0.0, 0.5], [0.1, 0.0, 0.5], [0.0] * 3, [-0.1, 0.0, 0.6]])


def test_points_are_told_by_hand(
    messages: PointMessages, seen: PaintSeen, positions: Array
) -> None:
    points, incoherent = messages.of(estimates(positions), 0)
    assert [[point.name for point in of] for of in points.values()] == [
        ["wrist", "index_tip"],
        ["index_tip"],
    ]
    assert list(points) == ["left", "right"]
    wrist, tip = points["left"]
    assert wrist.position_m == (0.012346, 0.0, 0.5)
    assert wrist.sigma_m == (0.002, 0.002, 0.002)
    assert wrist.covariance_m2 == (4e-6, 0.0, 0.0, 4e-6, 0.0, 4e-6)
    assert (wrist.cameras, wrist.source) == (["near", "far"], "measured")
    assert (tip.cameras, tip.source) == (["near"], "predicted")
    assert points["right"][0].cameras == ["far"]
    assert incoherent == 0
    np.testing.assert_array_equal(seen.places[[0, 1, 3]], positions[[0, 1, 3]])
    assert np.isnan(seen.places[2]).all()


def test_what_is_no_number_or_of_another_hand_is_not_told(
    messages: PointMessages, positions: Array
) -> None:
    positions[1, 2] = np.inf
    told = estimates(positions)
    told.detected[:] = [True, True, True, True]
    points, incoherent = messages.of(told, 0)
    assert [point.name for point in points["left"]] == ["wrist"]
    # One of the two that two cameras detect is enough; of more than two that would be none.
    assert len(points["right"]) == 1
    assert incoherent == 0
