"""Which points of a message are used."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.hand import LANDMARKS, forward, landmark_point
from rhot.messages import HandPoints
from services.solver.whole_hand.landmarks import Landmark, hand_landmarks
from services.solver.whole_hand.point_check import usable_points


@pytest.fixture
def message(world: Callable) -> HandPoints:
    ours = world("right")
    return ours.message(ours.points(ours.motion(1, 1)[0]), 0)


@pytest.fixture
def landmarks(world: Callable) -> dict[str, Landmark]:
    return hand_landmarks(world("right").model)


def _replaced(message: HandPoints, index: int, **fields: object) -> HandPoints:
    points = list(message.points)
    points[index] = msgspec.structs.replace(points[index], **fields)
    return msgspec.structs.replace(message, points=points)


def test_good_points_pass(message: HandPoints, landmarks: dict[str, Landmark]) -> None:
    observed = usable_points(message, landmarks)
    assert list(observed) == [point.name for point in message.points]
    assert all(observation.measured for observation in observed.values())
    np.testing.assert_allclose(observed["wrist"].covariance_m2, 1e-6 * np.eye(3))


def test_more_is_added_along_each_axis(message: HandPoints, landmarks: dict[str, Landmark]) -> None:
    moved = _replaced(message, 2, position_m=(5.0, 5.0, 5.0))
    for told in (message, moved):  # all sound, and without an outlier
        plain, wider = (usable_points(told, landmarks, more_m2) for more_m2 in (0.0, 4e-6))
        assert list(plain) == list(wider)
        for name, one in plain.items():
            np.testing.assert_allclose(
                wider[name].covariance_m2, one.covariance_m2 + 4e-6 * np.eye(3)
            )


@pytest.mark.parametrize("value", [1e300, -1e300, np.nan, np.inf, 11.0])
def test_absurd_positions_are_dropped(
    message: HandPoints, landmarks: dict[str, Landmark], value: float
) -> None:
    observed = usable_points(_replaced(message, 2, position_m=(0.0, value, 0.5)), landmarks)
    assert list(observed) == [point.name for i, point in enumerate(message.points) if i != 2]


@pytest.mark.parametrize("sigma", [np.nan, np.inf, 1e300, 0.2])
def test_points_that_know_nothing_are_dropped(
    message: HandPoints, landmarks: dict[str, Landmark], sigma: float
) -> None:
    vague = _replaced(message, 1, sigma_m=(1e-3, sigma, sigma))
    assert len(usable_points(vague, landmarks)) == 5


def test_a_point_that_one_camera_sees_is_known_across_its_ray(
    message: HandPoints, landmarks: dict[str, Landmark]
) -> None:
    ray = np.array([0.6, 0.0, 0.8])
    long = 1e-6 * np.eye(3) + 0.3**2 * np.outer(ray, ray)
    seen = _replaced(
        message,
        1,
        sigma_m=tuple(np.sqrt(np.diag(long)).tolist()),
        covariance_m2=tuple(long[np.triu_indices(3)].tolist()),
        cameras=["left"],
        source="predicted",
    )
    observed = usable_points(seen, landmarks)["thumb_tip"]
    assert not observed.measured
    across = np.array([[0.8, 0.0, -0.6], [0.0, 1.0, 0.0]])
    found = across @ observed.covariance_m2 @ across.T
    np.testing.assert_allclose(found, 1e-6 * np.eye(2), atol=1e-9)
    # Six that are wrong together tell no more than one.
    assert ray @ observed.covariance_m2 @ ray == pytest.approx(6.0 * 0.3**2, rel=1e-3)


@pytest.mark.parametrize(
    "covariance",
    [
        (np.nan, 0.0, 0.0, 1e-6, 0.0, 1e-6),
        (1e300, 0.0, 0.0, 1e-6, 0.0, 1e-6),
        (1e-6, 1e-3, 0.0, 1e-6, 0.0, 1e-6),
        (-1e-3, 0.0, 0.0, 1e-6, 0.0, 1e-6),
        (0.1, 0.0, 0.0, 0.1, 0.0, 1e-6),
    ],
)
def test_absurd_covariances_are_dropped(
    message: HandPoints, landmarks: dict[str, Landmark], covariance: tuple
) -> None:
    assert len(usable_points(_replaced(message, 1, covariance_m2=covariance), landmarks)) == 5


def test_too_good_a_sigma_is_not_believed(
    message: HandPoints, landmarks: dict[str, Landmark]
) -> None:
    observed = usable_points(_replaced(message, 1, sigma_m=(0.0, 0.0, 0.0)), landmarks)
    assert np.linalg.eigvalsh(observed["thumb_tip"].covariance_m2).min() > 1e-8


def test_predicted_points_weigh_less(message: HandPoints, landmarks: dict[str, Landmark]) -> None:
    unseen = _replaced(message, 1, source="predicted", cameras=[])
    observed = usable_points(unseen, landmarks)
    assert not observed["thumb_tip"].measured
    np.testing.assert_allclose(observed["thumb_tip"].covariance_m2, 9e-6 * np.eye(3))


def test_unknown_names_and_repetitions(message: HandPoints, landmarks: dict[str, Landmark]) -> None:
    twice = msgspec.structs.replace(
        message,
        points=[
            *message.points,
            msgspec.structs.replace(message.points[0], position_m=(0.0, 0.0, 0.0)),
        ],
    )
    nose = _replaced(twice, 3, name="nose")
    observed = usable_points(nose, landmarks)
    assert set(observed) == {point.name for point in message.points} - {message.points[3].name}
    np.testing.assert_array_equal(observed["wrist"].point_m, message.points[0].position_m)


@pytest.mark.parametrize("index", [0, 1, 4])
def test_a_point_of_another_hand_is_dropped(
    message: HandPoints, landmarks: dict[str, Landmark], index: int
) -> None:
    moved = np.array(message.points[index].position_m) + np.array([0.6, 0.0, 0.0])
    observed = usable_points(_replaced(message, index, position_m=tuple(moved)), landmarks)
    assert message.points[index].name not in observed
    assert len(observed) == 5


def test_no_posture_of_a_hand_is_taken_for_two_hands(world: Callable) -> None:
    ours = world("right")
    landmarks = hand_landmarks(ours.model)
    for instant in ours.motion(2, 60):
        joints = forward(ours.model, instant.rotation, instant.position_m, instant.angles_rad)
        everything = {name: landmark_point(ours.model, name, *joints) for name in LANDMARKS}
        assert len(usable_points(ours.message(everything, 0), landmarks)) == len(LANDMARKS)


def test_nothing_is_no_error(message: HandPoints, landmarks: dict[str, Landmark]) -> None:
    assert usable_points(msgspec.structs.replace(message, points=[]), landmarks) == {}
