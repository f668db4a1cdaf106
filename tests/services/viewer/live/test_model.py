"""Messages in, views out: freshness, implausible values, bounds."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rhot.messages import HandPoints, HandPose
from rhot.messages.health import Health
from rhot.messages.objects import ObjectContacts, ObjectPose
from services.viewer.live.model import HEALTH_STALE_S, STALE_S, TRAIL, TRAIL_S, ViewModel

STAMP_NS = 1_700_000_000_000_000_000


def test_a_hand_is_shown_until_it_is_stale(
    make_pose: Callable[..., HandPose], make_points: Callable[..., HandPoints]
) -> None:
    model = ViewModel()
    assert model.view(0.0).hands == {}
    pose = make_pose()
    model.pose(pose, 1.0, STAMP_NS + 31_000_000)
    model.points(make_points("index_tip", "nonsense"), 1.0)
    view = model.view(1.0 + STALE_S)
    hand = view.hands["right"]
    np.testing.assert_array_equal(hand.positions_m, [j.position_m for j in pose.joints])
    assert hand.sources == ("solved",) * 26
    assert view.latency_ms["right"] == pytest.approx(31.0)
    assert list(view.points) == [("right", "index_tip")]
    assert not view.points["right", "index_tip"].predicted
    assert model.implausible == 1
    empty = model.view(1.01 + STALE_S)
    assert empty.hands == empty.points == empty.latency_ms == empty.trails == {}


@pytest.mark.parametrize("wall_ns", [0, STAMP_NS - 11 * 10**9, STAMP_NS + 11 * 10**9, 2**63])
def test_stamps_of_another_time_say_nothing_about_latency(
    make_pose: Callable[..., HandPose], wall_ns: int
) -> None:
    model = ViewModel()
    model.pose(make_pose(), 0.0, wall_ns)
    assert model.view(0.0).latency_ms == {"right": None}


@pytest.mark.parametrize(
    "at", [(math.nan, 0.0, 0.0), (0.0, 1e300, 0.0), (0.0, 0.0, -101.0), (math.inf, 0.0, 0.0)]
)
def test_implausible_positions_are_not_drawn(
    make_pose: Callable[..., HandPose],
    make_points: Callable[..., HandPoints],
    make_object: Callable[..., ObjectPose],
    at: tuple[float, float, float],
) -> None:
    model = ViewModel()
    model.pose(make_pose(at), 0.0, STAMP_NS)
    model.points(make_points("wrist", at=at), 0.0)
    model.object(make_object(position_m=at), 0.0)
    view = model.view(0.0)
    assert view.hands == view.points == view.objects == {}
    assert model.implausible == 3


@pytest.mark.parametrize(
    "wxyz", [(0.0, 0.0, 0.0, 0.0), (1e300, 1e300, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)]
)
def test_implausible_orientations_are_not_drawn(
    make_object: Callable[..., ObjectPose], wxyz: tuple[float, ...]
) -> None:
    model = ViewModel()
    model.object(make_object(orientation_wxyz=wxyz), 0.0)
    assert model.view(0.0).objects == {}


@pytest.mark.parametrize(
    ("fields", "drawn"),
    [
        ({}, True),
        ({"tracking": "rotation_only"}, True),
        ({"tracking": "lost"}, False),
        ({"registered": False}, False),
        ({"tracking": "unregistered"}, False),
    ],
)
def test_objects_are_drawn_where_they_are_known(
    make_object: Callable[..., ObjectPose], fields: dict[str, object], drawn: bool
) -> None:
    model = ViewModel()
    model.object(make_object(**fields), 0.0)
    assert model.view(0.0).objects["cup"].drawn is drawn


@pytest.mark.parametrize(
    ("fields", "state"),
    [
        ({}, "ok"),
        ({"tracking": "calibrating"}, "calibrating"),
        ({"registered": False}, "unregistered"),
        ({"registered": False, "tracking": "out_of_range"}, "unregistered"),
        ({"registered": False, "tracking": "lost"}, "lost"),
    ],
)
def test_what_hinders_most_is_an_objects_state(
    make_object: Callable[..., ObjectPose], fields: dict[str, object], state: str
) -> None:
    model = ViewModel()
    model.object(make_object(**fields), 0.0)
    view = model.view(0.0).objects["cup"]
    assert (view.state, view.certain) == (state, state == "ok")


def test_who_touches_and_holds_is_known_while_contacts_come(
    make_contacts: Callable[..., ObjectContacts],
) -> None:
    model = ViewModel()
    model.contacts(
        make_contacts("thumb", "index", held=("thumb", "index", "index"), near=("ring",)), 1.0
    )
    view = model.view(1.0 + STALE_S)
    assert [(one.object, one.hand, one.part) for one in view.touches] == [
        ("cup", "right", "thumb"),
        ("cup", "right", "index"),
    ]
    (hold,) = view.holds
    assert (hold.object, hold.hand, hold.parts) == ("cup", "right", ("thumb", "index"))
    later = model.view(1.01 + STALE_S)
    assert (later.touches, later.holds) == ([], [])


@pytest.mark.parametrize("at", [(math.nan, 0.0, 0.0), (0.0, -1e300, 0.0)])
def test_touches_nowhere_are_left_out(
    make_contacts: Callable[..., ObjectContacts], at: tuple[float, float, float]
) -> None:
    model = ViewModel()
    model.contacts(make_contacts("thumb", at=at), 0.0)
    assert model.view(0.0).touches == []
    assert model.implausible == 1


def test_an_object_that_comes_no_more_is_missed(make_object: Callable[..., ObjectPose]) -> None:
    model = ViewModel()
    assert model.view(0.0).silent_s == {}
    model.object(make_object(), 1.0)
    assert model.view(1.5).silent_s == {}
    assert model.view(6.0).silent_s == {"cup": 5.0}
    model.object(make_object(), 7.0)
    assert model.view(7.0).silent_s == {}


def test_trails_are_where_the_tips_have_just_been_and_begin_anew_after_a_loss(
    make_pose: Callable[..., HandPose],
) -> None:
    model = ViewModel()
    for i in range(100):
        model.pose(make_pose((0.001 * i, 0.0, 0.5)), 0.03 * i, STAMP_NS)
    trail = np.array(model.view(0.03 * 99).trails["right"])
    assert trail.shape == (1 + int(TRAIL_S / 0.03), 5, 3)
    np.testing.assert_allclose(trail[:, 0, 0], 0.001 * np.arange(100 - len(trail), 100))
    for i in range(10 * TRAIL):
        model.pose(make_pose(), 3.0 + 1e-4 * i, STAMP_NS)
    assert len(model.view(3.0 + 1e-3 * TRAIL).trails["right"]) == TRAIL
    model.pose(make_pose(), 100.0, STAMP_NS)
    assert len(model.view(100.0).trails["right"]) == 1


def test_a_joint_without_an_orientation_is_not_turned(make_pose: Callable[..., HandPose]) -> None:
    pose = make_pose()
    joints = list(pose.joints)
    joints[3] = msgspec.structs.replace(joints[3], orientation_wxyz=(0.0, 0.0, 0.0, 0.0))
    joints[4] = msgspec.structs.replace(joints[4], orientation_wxyz=(1e300, 0.0, 1e300, 0.0))
    joints[5] = msgspec.structs.replace(joints[5], orientation_wxyz=(0.0, 1.0, 0.0, 0.0))
    model = ViewModel()
    model.pose(make_pose(joints=joints), 0.0, STAMP_NS)
    rotations = model.view(0.0).hands["right"].rotations
    np.testing.assert_allclose(rotations[3:5], [np.eye(3)] * 2)
    np.testing.assert_allclose(rotations[5], np.diag([1.0, -1.0, -1.0]), atol=1e-12)


def test_what_is_known_of_a_marker_s_error_is_kept(make_points: Callable[..., HandPoints]) -> None:
    model = ViewModel()
    points = make_points("index_tip")
    model.points(points, 0.0)
    (view,) = model.view(0.0).points.values()
    np.testing.assert_allclose(view.covariance_m2, [1e-6, 0, 0, 1e-6, 0, 1e-6])
    known = (3e-6, 1e-7, 0.0, 2e-6, 0.0, 1e-6)
    point = msgspec.structs.replace(points.points[0], covariance_m2=known)
    model.points(msgspec.structs.replace(points, points=[point]), 0.0)
    (view,) = model.view(0.0).points.values()
    assert view.covariance_m2 == known


def test_state_is_bounded(
    make_object: Callable[..., ObjectPose],
    make_health: Callable[..., Health],
    make_contacts: Callable[..., ObjectContacts],
) -> None:
    model = ViewModel()
    for i in range(1000):
        model.contacts(make_contacts("thumb", held=("thumb",), name=f"o{i}"), 0.0)
        model.object(make_object(f"o{i}"), 0.0)
        model.health(make_health(f"s{i}"), 0.0)
    view = model.view(0.0)
    assert (len(view.objects), len(view.health)) == (32, 64)
    assert (len(view.touches), len(view.holds)) == (32, 32)
    assert len(model.view(2.0).silent_s) == 32
    # What has left makes room.
    later = 1.0 + HEALTH_STALE_S
    assert model.view(later).health == []
    model.object(make_object("new"), later)
    assert list(model.view(later).objects) == ["new"]


numbers = st.floats(allow_nan=True, allow_infinity=True)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    at=st.tuples(numbers, numbers, numbers),
    wxyz=st.tuples(numbers, numbers, numbers, numbers),
    wall_ns=st.integers(-(2**70), 2**70),
)
def test_whatever_comes_only_finite_things_are_drawn(
    make_pose: Callable[..., HandPose],
    make_object: Callable[..., ObjectPose],
    at: tuple[float, ...],
    wxyz: tuple[float, ...],
    wall_ns: int,
) -> None:
    model = ViewModel()
    model.pose(make_pose(at), 0.0, wall_ns)
    model.object(make_object(position_m=at, orientation_wxyz=wxyz), 0.0)
    view = model.view(0.0)
    for hand in view.hands.values():
        assert np.all(np.isfinite(hand.positions_m.astype(np.float32)))
    for thing in view.objects.values():
        assert np.all(np.isfinite([*thing.position_m, *thing.orientation_wxyz]))
