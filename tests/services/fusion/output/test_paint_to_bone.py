"""Where the centroid of a painted finger tip is: by ray-casting two cameras, against surface.py and
patch.py.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_vector
from rhot.hand import JOINTS, default_hand
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from services.fusion.geometry.triangulation import extrinsics
from services.fusion.intake.observations import Slot
from services.fusion.output.paint_centroid import centroid_shift, located_shift, shift_table
from services.fusion.output.paint_to_bone import SIGMA_DAB, SIGMA_UNKNOWN, Surface, dab_sag_m
from testing.synthetic_points import Setup

RADIUS_M, PAINT_M, BASELINE_M, DISTANCE_M = 0.0068, 0.014, 0.075, 0.5
EYES = np.array([[0.0, 0.0, 0.0], [BASELINE_M, 0.0, 0.0]])


def visible_centroid(eye, tip, direction):
    """Centroid (x/z, y/z) of the painted part of a capsule that ends at tip, as seen from eye
    looking along +z.
    """
    middle = tip - 0.5 * PAINT_M * direction - eye
    half = 1.3 * (PAINT_M + RADIUS_M) / middle[2]
    grid = np.linspace(-half, half, 160)
    rays = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2) + middle[:2] / middle[2]
    D = np.column_stack([rays, np.ones(len(rays))])
    D /= np.linalg.norm(D, axis=1, keepdims=True)
    w = eye - (tip - RADIUS_M * direction)  # from the centre of the end's sphere
    along, w_along = D @ direction, w @ direction
    a, b, c = 1.0 - along**2, D @ w - along * w_along, w @ w - w_along**2 - RADIUS_M**2
    t = (-b - np.sqrt(np.maximum(b**2 - a * c, 0.0))) / a
    cylinder = (b**2 > a * c) & (w_along + t * along <= 0.0)
    b_ball, c_ball = D @ w, w @ w - RADIUS_M**2
    ball = b_ball**2 > c_ball
    t = np.minimum(
        np.where(cylinder, t, np.inf),
        np.where(ball, -b_ball - np.sqrt(np.maximum(b_ball**2 - c_ball, 0.0)), np.inf),
    )
    hit = np.isfinite(t)
    depth_of_paint = -((w + np.where(hit, t, 0.0)[:, None] * D) @ direction) + RADIUS_M
    painted = hit & (depth_of_paint <= PAINT_M)
    return rays[painted].mean(axis=0) if painted.sum() > 20 else None


def random_fingers(
    n: int, *, hidden: float = 0.9
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Random landmarks and finger directions, with where two cameras locate the visible centroid."""
    random = np.random.default_rng(0)
    found = 0
    while found < n:
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        if direction[2] > hidden:  # the finger hides its own tip
            continue
        point = np.array([random.uniform(-0.06, 0.14), random.uniform(-0.1, 0.1), DISTANCE_M])
        seen = [visible_centroid(eye, point + 0.5 * PAINT_M * direction, direction) for eye in EYES]
        if seen[0] is None or seen[1] is None:
            continue
        found += 1
        z = BASELINE_M / (seen[0][0] - seen[1][0])
        yield point, direction, np.array([seen[0][0] * z, 0.5 * (seen[0][1] + seen[1][1]) * z, z])


def split(error, point):
    """An error along the mean viewing ray, and its length across it."""
    away = point - EYES.mean(axis=0)
    away /= np.linalg.norm(away)
    return error @ away, np.linalg.norm(error - (error @ away) * away)


def test_the_constants_are_what_ray_casting_gives():
    along, across = np.array(
        [split(located - point, point) for point, _, located in random_fingers(150)]
    ).T
    # Nowhere near a radius (6.8 mm) towards the cameras, as if the centroid lay on the skin.
    assert abs(along.mean()) < 1e-3
    assert along.std() / RADIUS_M == pytest.approx(SIGMA_UNKNOWN[0], abs=0.06)
    assert np.sqrt(np.mean(across**2) / 2.0) / RADIUS_M == pytest.approx(SIGMA_UNKNOWN[1], abs=0.03)


def test_shift_is_along_the_finger_and_vanishes_end_on():
    table = shift_table(RADIUS_M, PAINT_M)
    assert centroid_shift(table, -1.0) == pytest.approx(0.0, abs=1e-5)
    # Seen from the side, the round end has less paint than the straight stretch behind it.
    assert -1e-3 < centroid_shift(table, 0.0) < -0.3e-3
    assert -2e-3 < centroid_shift(table, -0.6) < -1e-3
    assert not shift_table(0.0, 0.01).any()


def test_known_direction_explains_where_the_centroid_is_located():
    cameras = tuple(Setup(distortion=(0.0,) * 5).rig().values())
    R, t = extrinsics(cameras)
    table, shift, left = shift_table(RADIUS_M, PAINT_M), np.zeros(3), []
    for point, direction, located in random_fingers(150, hidden=0.7):
        assert located_shift(table, located, direction, R, t, shift)
        left.append(split(located - shift - point, point))
    along, across = np.array(left).T
    # What is left is the coarse grid of the ray-casting here (.25 mm a ray) and that parallel rays
    # stand for a near camera's.
    assert np.sqrt(np.mean(along**2)) < 0.7e-3
    assert np.sqrt(np.mean(across**2)) < 0.2e-3


SLOTS = (Slot("right", "wrist"), Slot("right", "index_tip"))


@pytest.fixture
def surface() -> Surface:
    return Surface(SLOTS, {"right": default_hand("right")}, tuple(Setup().rig().values()))


def pose(stamp_ns: int, wxyz, source="solved") -> HandPose:
    joints = [
        HandJoint(
            name=name,
            position_m=(0.0, 0.0, 0.5),
            orientation_wxyz=wxyz,
            radius_m=0.01,
            source=source,
        )
        for name in JOINTS
    ]
    angles = FingerAngles(abduction=0.0, mcp=0.0, pip=0.0, dip=0.0)
    names = ("thumb", "index", "middle", "ring", "little")
    fingers = [
        FingerPose(name=name, angles_rad=angles, residual_m=0.0, iterations=1, status="solved")
        for name in names
    ]
    wrist = WristPose(position_m=(0.0, 0.0, 0.5), orientation_wxyz=wxyz)
    return HandPose(
        hand="right",
        seq=0,
        stamp_ns=stamp_ns,
        method="test",
        wrist=wrist,
        joints=joints,
        fingers=fingers,
    )


POSITIONS = np.array([[0.0, 0.1, 0.5], [0.03, -0.05, 0.5]])
COVARIANCES = np.tile(1e-8 * np.eye(3), (2, 1, 1))
BOTH = np.ones((2, 2), dtype=bool)
# The finger points at the cameras, tilted by half a radian.
TOWARDS = tuple(quaternion_from_rotation(rotation_from_vector([0.5, 0.0, 0.0])).tolist())


# 16 mm of paint on a wrist 21 mm thick.
SAG_M = dab_sag_m(0.008, 0.021)


def is_untouched(positions) -> bool:
    """The tip is where it was, the dab is nearer to the cameras by its sag."""
    return (
        np.array_equal(positions[1], POSITIONS[1])
        and np.linalg.norm(positions[0]) < np.linalg.norm(POSITIONS[0]) - 0.9 * SAG_M
    )


def located_depth_m(normals, weights, places):
    """How deep below the top two cameras 9 degrees apart locate skin, each by the middle of what it
    sees, weighed by how it faces it.
    """
    shifts = []
    for angle in (-0.08, 0.08):
        facing = weights * (normals @ [np.sin(angle), 0.0, np.cos(angle)])
        shifts.append(np.average(places @ [np.cos(angle), 0.0, -np.sin(angle)], weights=facing))
    return 0.021 - (shifts[0] - shifts[1]) / (2.0 * np.sin(0.08))


def test_two_cameras_locate_a_dab_at_its_rim():
    """Against points spread over the cap of a ball, and over a cylinder.

    A dab on nothing lies where it is seen.
    """
    side = np.linspace(-0.008, 0.008, 801)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    inside = x**2 + y**2 < 0.008**2
    x, y = x[inside], y[inside]
    ball = np.column_stack([x, y, np.sqrt(0.021**2 - x**2 - y**2)])
    # As seen from above, a patch of skin is larger than it looks by 1 / cosine.
    deep_m = located_depth_m(ball / 0.021, 0.021 / ball[:, 2], ball)
    assert dab_sag_m(0.008, 0.021) == pytest.approx(deep_m, rel=0.01)
    roll = np.column_stack([x, y, np.sqrt(0.021**2 - x**2)])
    deep_m = located_depth_m(roll * [1.0, 0.0, 1.0] / 0.021, 0.021 / roll[:, 2], roll)
    assert 0.75 * dab_sag_m(0.008, 0.021) == pytest.approx(deep_m, rel=0.03)
    assert dab_sag_m(0.008, 0.0) == 0.0


def test_without_a_pose_tips_stay_and_sigma_says_so(surface):
    positions, covariances = surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18)
    assert is_untouched(positions)
    np.testing.assert_allclose(np.linalg.norm(positions[0] - POSITIONS[0]), SAG_M)
    depth_mm = 1e3 * np.sqrt(covariances[:, 2, 2])
    assert depth_mm[1] == pytest.approx(0.29 * 6.8, rel=0.05)
    assert depth_mm[0] == pytest.approx(SIGMA_DAB * 16.0, rel=0.05)


def test_a_pose_corrects_tips_while_it_is_fresh(surface):
    surface.note(pose(10**18, TOWARDS))
    positions, covariances = surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18 + 33_000_000)
    # The palm side of the wrist, -y of its frame, turned with the hand.
    np.testing.assert_allclose(
        positions[0] - POSITIONS[0], SAG_M * np.array([0.0, -np.cos(0.5), -np.sin(0.5)]), atol=1e-12
    )
    assert -3e-3 < positions[1, 2] - POSITIONS[1, 2] < -1e-3
    unknown = Surface(
        SLOTS, {"right": default_hand("right")}, tuple(Setup().rig().values())
    ).to_axis(POSITIONS, COVARIANCES, BOTH, 10**18)[1]
    assert covariances[1, 2, 2] < 0.5 * unknown[1, 2, 2]
    late, _ = surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18 + 400_000_000)
    assert is_untouched(late)
    surface.forget()
    assert is_untouched(surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18)[0])


def test_the_end_of_a_finger_that_points_at_the_cameras_is_known_least(surface):
    sigmas_mm = []
    for angle in (0.0, 0.5, 1.5):
        turn = rotation_from_vector([angle, 0.0, 0.0])
        surface.note(pose(10**18, tuple(quaternion_from_rotation(turn).tolist())))
        sigmas_mm.append(
            1e3
            * np.sqrt(surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18)[1][1, [1, 2], [1, 2]])
        )
    towards, tilted, side = np.array(sigmas_mm)
    assert np.all(towards > tilted)
    assert np.all(tilted > side)
    # A resting hand's tips, seen from the side, were .13-.2 mm off across and their model .0-.1 mm
    # in depth.
    assert np.all(side < 0.2)


@pytest.mark.parametrize(
    "wxyz", [(0.0, 0.0, 0.0, 0.0), (1e300, 1.0, 0.0, 0.0), (1e-9, 0.0, 0.0, 0.0)]
)
def test_absurd_or_predicted_poses_are_not_believed(surface, wxyz):
    surface.note(pose(10**18, wxyz))
    surface.note(pose(10**18, TOWARDS, source="predicted"))
    assert is_untouched(surface.to_axis(POSITIONS, COVARIANCES, BOTH, 10**18)[0])


def test_any_number_of_cameras_agrees_on_the_shift():
    table, direction = shift_table(RADIUS_M, PAINT_M), np.array([0.3, -0.6, -0.74])
    shifts = []
    for cameras in (2, 4):
        R, t = extrinsics(tuple(Setup(cameras=cameras).rig().values()))
        shift = np.zeros(3)
        assert located_shift(
            table, POSITIONS[1], direction / np.linalg.norm(direction), R, t, shift
        )
        shifts.append(shift)
    np.testing.assert_allclose(shifts[0], shifts[1], atol=0.3e-3)
