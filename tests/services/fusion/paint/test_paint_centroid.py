"""Where the centroid of a painted finger tip is seen and located, against ray-casting."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import Extrinsics, extrinsics
from services.fusion.paint.paint_centroid import Finger, centroid_shift, expected_shift
from services.fusion.paint.visible_paint import paint_tables
from testing.synthetic_points import SyntheticRig

RADIUS_M, PAINT_M = 0.0068, 0.014
# As index fingers of the tables taper.
TAPER = 0.078


def finger_shift(
    table: Array,
    point: Array,
    direction: Array,
    cameras: Extrinsics,
    sigmas_rad: tuple[float, float] = (0.0, 0.0),
) -> tuple[Array, Array]:
    """The shift (3,) of a finger of known thickness that bends about x, and its covariance."""
    hinge = np.cross(direction, np.cross([1.0, 0.0, 0.0], direction))
    finger = Finger(direction, hinge / np.linalg.norm(hinge), np.array(sigmas_rad), 0.0)
    shift, covariance = np.empty(3), np.empty((3, 3))
    assert expected_shift(table, point, finger, cameras, shift, covariance)
    return shift, covariance


def visible_middle(sine: float, cosine: float) -> float:
    """The shift of a tapered finger's visible paint: its skin as balls side by side.

    Its middle is that of what can be seen of them, from along z; the finger points along (sine, 0,
    cosine). Balls do not touch each other's outlines as a cone does, but there are many.
    """
    step, reach = RADIUS_M / 25.0, 0.02
    u, w = np.meshgrid(np.arange(-reach, reach, step), np.arange(step / 2, 0.012, step))
    depth = np.full(u.shape, np.inf)
    for behind in np.arange(0.0, PAINT_M + 0.012, 1e-4):
        radius = RADIUS_M + TAPER * behind
        inside = radius**2 - (u + behind * sine) ** 2 - w**2
        near = np.where(inside > 0.0, -behind * cosine - np.sqrt(np.maximum(inside, 0.0)), np.inf)
        depth = np.minimum(depth, near)
    hit = np.isfinite(depth)
    along = u * sine + np.where(hit, depth, 0.0) * cosine
    painted = hit & (along >= RADIUS_M - PAINT_M)
    # From the landmark, half of the paint from the end.
    return float(u[painted].mean()) + (0.5 * PAINT_M - RADIUS_M) * sine


def test_shift_is_along_the_finger_and_vanishes_end_on():
    table = paint_tables(RADIUS_M, PAINT_M).shifts_m
    assert centroid_shift(table, -1.0) == pytest.approx(0.0, abs=1e-5)
    # Seen from the side, the round end has less paint than the straight stretch behind it.
    assert -1e-3 < centroid_shift(table, 0.0) < -0.3e-3
    assert -2e-3 < centroid_shift(table, -0.6) < -1e-3
    assert not paint_tables(0.0, 0.01).shifts_m.any()


def test_a_taper_moves_the_middle_as_its_skin_does():
    table, plain = (
        paint_tables(RADIUS_M, PAINT_M, TAPER).shifts_m,
        paint_tables(RADIUS_M, PAINT_M).shifts_m,
    )
    for angle in (60.0, 90.0, 120.0, 150.0, 170.0):
        sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
        found = centroid_shift(table, cosine)
        assert found == pytest.approx(visible_middle(sine, cosine), abs=0.1e-3)
    # It widens away from its end: of a finger that points at the camera more shows behind.
    assert centroid_shift(table, -0.7) < centroid_shift(plain, -0.7) - 0.2e-3
    assert centroid_shift(table, 0.5) > centroid_shift(plain, 0.5) + 0.05e-3
    # From behind, the finger hides its own end.
    assert centroid_shift(table, 1.0) == 0.0


def test_known_direction_explains_where_the_centroid_is_located(random_fingers, split):
    cameras = extrinsics(tuple(SyntheticRig(distortion=(0.0,) * 5).rig().values()))
    table, left = paint_tables(RADIUS_M, PAINT_M).shifts_m, []
    for point, direction, located in random_fingers(150, hidden=0.7):
        shift, covariance = finger_shift(table, located, direction, cameras)
        np.testing.assert_allclose(covariance, 0.0, atol=1e-20)
        left.append(split(located - shift - point, point))
    along, across = np.array(left).T
    # What is left is the coarse grid of the ray-casting here (.25 mm a ray) and that parallel rays
    # stand for a near camera's.
    assert np.sqrt(np.mean(along**2)) < 0.7e-3
    assert np.sqrt(np.mean(across**2)) < 0.2e-3


def test_any_number_of_cameras_agrees_on_the_shift():
    table, direction = paint_tables(RADIUS_M, PAINT_M).shifts_m, np.array([0.3, -0.6, -0.74])
    direction /= np.linalg.norm(direction)
    shifts = []
    for cameras in (2, 4):
        rig = extrinsics(tuple(SyntheticRig(cameras=cameras).rig().values()))
        shifts.append(finger_shift(table, np.array([0.03, -0.05, 0.5]), direction, rig)[0])
    np.testing.assert_allclose(shifts[0], shifts[1], atol=0.3e-3)


def test_an_unsure_bend_makes_a_tip_unsure_in_its_plane():
    """A finger along y that bends about x: unsure there it is unsure in y and z, sideways in x."""
    rig = extrinsics(tuple(SyntheticRig().rig().values()))
    table, point = paint_tables(RADIUS_M, PAINT_M).shifts_m, np.array([0.0, 0.0, 0.5])
    direction = np.array([0.0, -0.8, -0.6])
    _, bent = finger_shift(table, point, direction, rig, (0.2, 0.0))
    _, turned = finger_shift(table, point, direction, rig, (0.0, 0.2))
    assert bent[0, 0] < 0.1 * bent[2, 2]
    assert turned[0, 0] > 5.0 * turned[1, 1]
    assert turned[0, 0] > 5.0 * bent[0, 0]


def test_the_mean_shift_of_a_finger_that_points_at_the_cameras_is_not_that_of_its_direction():
    """Its depth depends most on the direction there: mostly it points a little elsewhere."""
    rig = extrinsics(tuple(SyntheticRig().rig().values()))
    table, point = paint_tables(RADIUS_M, PAINT_M, TAPER).shifts_m, np.array([0.0375, 0.0, 0.5])
    sure, _ = finger_shift(table, point, np.array([0.0, 0.0, -1.0]), rig)
    unsure, covariance = finger_shift(table, point, np.array([0.0, 0.0, -1.0]), rig, (0.15, 0.15))
    random, shifts = np.random.default_rng(3), []
    for _ in range(300):
        x, y = random.normal(0.0, 0.15, 2)
        direction = np.array([x, y, -1.0]) / np.sqrt(1.0 + x * x + y * y)
        shifts.append(finger_shift(table, point, direction, rig)[0])
    drawn = np.array(shifts)
    assert abs(unsure[2] - drawn[:, 2].mean()) < 0.5 * abs(sure[2] - drawn[:, 2].mean())
    assert 0.3 < covariance[0, 0] / drawn[:, 0].var() < 3.0


@pytest.mark.parametrize("sigma_deg", [16.0, 25.0])
def test_how_unsure_a_tip_is_by_a_very_unsure_direction(sigma_deg: float):
    """A finger that nearly points at the cameras: its depth's spread is that of directions drawn.

    Differences of first order call it 1.37 and .69 times that.
    """
    rig = extrinsics(tuple(SyntheticRig().rig().values()))
    table, point = paint_tables(RADIUS_M, PAINT_M, TAPER).shifts_m, np.array([0.0375, 0.0, 0.6])
    about, sideways = np.radians(sigma_deg), 0.6 * np.radians(sigma_deg)
    direction = np.array([0.0, 0.3, -0.95]) / np.hypot(0.3, 0.95)
    across = np.cross([1.0, 0.0, 0.0], direction)
    _, covariance = finger_shift(table, point, direction, rig, (about, sideways))
    random, shifts = np.random.default_rng(3), []
    for a, b in random.normal(0.0, (about, sideways), (600, 2)):
        angle = np.hypot(a, b)
        away = (a * across + b * np.array([1.0, 0.0, 0.0])) / angle
        turned = np.cos(angle) * direction + np.sin(angle) * away
        shifts.append(finger_shift(table, point, turned, rig)[0])
    spread = np.std(np.array(shifts)[:, 2])
    assert 0.8 < np.sqrt(covariance[2, 2]) / spread < 1.25
