"""From paint to bone: what is taken off with a pose and without, and what covariance says."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.hand import JOINTS, default_hand
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.observations import Landmark
from services.fusion.paint.known_paint import (
    SIGMA_FACING_RAD,
    SIGMA_UNKNOWN,
    correct_paint,
)
from services.fusion.paint.paint_to_bone import PaintToBone, turn_vector
from services.fusion.paint.visible_paint import dab_sag_m
from testing.synthetic_points import SyntheticRig

RADIUS_M = 0.0068


def test_the_constants_are_what_ray_casting_gives(random_fingers, split):
    along, across = np.array(
        [split(located - point, point) for point, _, located in random_fingers(150)]
    ).T
    # Nowhere near a radius (6.8 mm) towards the cameras, as if the centroid lay on the skin.
    assert abs(along.mean()) < 1e-3
    assert along.std() / RADIUS_M == pytest.approx(SIGMA_UNKNOWN[0], abs=0.06)
    assert np.sqrt(np.mean(across**2) / 2.0) / RADIUS_M == pytest.approx(SIGMA_UNKNOWN[1], abs=0.03)


LANDMARKS = (Landmark("right", "wrist"), Landmark("right", "index_tip"))


@pytest.fixture
def paint() -> PaintToBone:
    return PaintToBone(
        LANDMARKS, {"right": default_hand("right")}, tuple(SyntheticRig().rig().values())
    )


def pose(stamp_ns: int, wxyz, source="solved", sigma_rad: float | None = None) -> HandPose:
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
        FingerPose(
            name=name,
            angles_rad=angles,
            residual_m=0.0,
            iterations=1,
            status="solved",
            sigma_rad=sigma_rad,
        )
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
        wrist_sigma_rad=sigma_rad,
    )


POSITIONS = np.array([[0.0, 0.1, 0.5], [0.03, -0.05, 0.5]])
COVARIANCES = np.tile(1e-8 * np.eye(3), (2, 1, 1))
BOTH = np.ones((2, 2), dtype=bool)
# The finger points at the cameras, tilted by half a radian.
TOWARDS = tuple(quaternion_from_rotation(rotation_from_vector([0.5, 0.0, 0.0])).tolist())


# 16 mm of paint on a wrist 21 mm thick.
SAG_M = dab_sag_m(0.008, 0.021)


def corrected(paint: PaintToBone, instant_ns: int, positions: Array = POSITIONS):
    """Landmarks (2, 3) and covariances (2, 3, 3) that both cameras see at an instant."""
    places, covariances = positions.copy(), COVARIANCES.copy()
    cameras = extrinsics(tuple(SyntheticRig().rig().values()))
    correct_paint(paint.known, instant_ns, places, covariances, BOTH, cameras)
    return places, covariances


def is_untouched(positions) -> bool:
    """The tip is where it was, the dab is nearer to the cameras by its sag."""
    return (
        np.array_equal(positions[1], POSITIONS[1])
        and np.linalg.norm(positions[0]) < np.linalg.norm(POSITIONS[0]) - 0.9 * SAG_M
    )


def test_without_a_pose_tips_stay_and_sigma_says_so(paint):
    positions, covariances = corrected(paint, 10**18)
    assert is_untouched(positions)
    np.testing.assert_allclose(np.linalg.norm(positions[0] - POSITIONS[0]), SAG_M)
    depth_mm = 1e3 * np.sqrt(covariances[:, 2, 2])
    assert depth_mm[1] == pytest.approx(0.29 * 6.8, rel=0.05)
    # The skin under the dab faces the cameras, more or less.
    across_mm = 1e3 * np.sqrt(covariances[0, 0, 0])
    assert across_mm == pytest.approx(1e3 * SAG_M * SIGMA_FACING_RAD, rel=0.05)


def test_a_dab_is_as_unsure_as_the_skin_under_it(paint):
    """Beside it by the wrist's orientation, deep by its limb's thickness."""
    found = []
    for sigma_rad in (0.05, 0.1):
        told = msgspec.structs.replace(
            pose(10**18, (1.0, 0.0, 0.0, 0.0)), wrist_sigma_rad=sigma_rad
        )
        paint.note(paint.directions(told))
        found.append(np.sqrt(corrected(paint, 10**18)[1][0].diagonal() - 1e-8))
    for sigma_rad, (x, y, z) in zip((0.05, 0.1), found, strict=True):
        # The normal of the wrist's skin is -y.
        assert x == pytest.approx(SAG_M * sigma_rad / np.sqrt(3.0), rel=1e-3)
        assert z == pytest.approx(x, rel=1e-3)
        assert y == pytest.approx(0.08 * SAG_M, rel=1e-3)


def shape_sigmas_m(paint: PaintToBone, shape_sd: float) -> Array:
    """Of a dab and a tip along each axis (2, 3), by paint of such a shape; directions are known."""
    paint.note(paint.directions(pose(10**18, (1.0, 0.0, 0.0, 0.0), sigma_rad=0.05)))
    paint.known.shape_sds[:] = shape_sd
    return np.sqrt(corrected(paint, 10**18)[1].diagonal(axis1=1, axis2=2))


def test_paint_that_is_unlike_its_model_has_another_middle(paint):
    alike, unlike = shape_sigmas_m(paint, 0.0), shape_sigmas_m(paint, 0.1)
    dab, tip = np.sqrt(unlike**2 - alike**2)
    # A tenth of a radius across, twice that along.
    assert np.linalg.norm(tip) == pytest.approx(0.1 * RADIUS_M * np.sqrt(6.0), rel=0.02)
    # Beside a dab, whose normal is -y, 1.7 times as much of its depth; twice in depth.
    np.testing.assert_allclose(dab, 0.1 * SAG_M * np.array([1.7, 2.0, 1.7]), rtol=0.02)


@pytest.mark.parametrize(("origin", "of"), [("tables", 0), ("measured", 0), ("simulated", -1)])
def test_paint_of_hands_that_somebody_painted_is_of_no_known_shape(origin, of):
    hand = msgspec.structs.replace(default_hand("right"), origin=origin)
    paint = PaintToBone(LANDMARKS, {"right": hand}, tuple(SyntheticRig().rig().values()))
    assert paint.known.hands.tolist() == [of, of]


def test_what_tapers_is_corrected_as_that(paint):
    """A finger that points at the cameras, tilted by half a radian, thicker at its joint or not."""
    table = default_hand("right")
    straight = [
        msgspec.structs.replace(
            digit, radii_m=(*digit.radii_m[:2], digit.radii_m[3], digit.radii_m[3])
        )
        for digit in table.digits
    ]
    plain = PaintToBone(
        LANDMARKS,
        {"right": msgspec.structs.replace(table, digits=tuple(straight))},
        tuple(SyntheticRig().rig().values()),
    )
    places = []
    for known in (paint, plain):
        known.note(known.directions(pose(10**18, TOWARDS, sigma_rad=0.02)))
        places.append(corrected(known, 10**18)[0][1])
    # Towards its end, which is up in the pictures and nearer.
    assert 0.15e-3 < np.linalg.norm(places[0][:2] - places[1][:2]) < 0.6e-3
    assert places[0][2] < places[1][2]


def test_a_pose_corrects_tips_while_it_is_fresh(paint):
    paint.note(paint.directions(pose(10**18, TOWARDS)))
    positions, covariances = corrected(paint, 10**18 + 33_000_000)
    # The palm side of the wrist, -y of its frame, turned with the hand.
    np.testing.assert_allclose(
        positions[0] - POSITIONS[0], SAG_M * np.array([0.0, -np.cos(0.5), -np.sin(0.5)]), atol=1e-12
    )
    assert -3e-3 < positions[1, 2] - POSITIONS[1, 2] < -1e-3
    unknown = corrected(
        PaintToBone(
            LANDMARKS, {"right": default_hand("right")}, tuple(SyntheticRig().rig().values())
        ),
        10**18,
    )[1]
    assert covariances[1, 2, 2] < 0.5 * unknown[1, 2, 2]
    late, _ = corrected(paint, 10**18 + 400_000_000)
    assert is_untouched(late)
    paint.reset()
    assert is_untouched(corrected(paint, 10**18)[0])


def test_the_end_of_a_finger_that_points_at_the_cameras_is_known_least(paint):
    sigmas_mm = []
    for angle in (0.0, 0.5, 1.5):
        turn = rotation_from_vector([angle, 0.0, 0.0])
        wxyz = tuple(quaternion_from_rotation(turn).tolist())
        paint.note(paint.directions(pose(10**18, wxyz, sigma_rad=0.03)))
        sigmas_mm.append(1e3 * np.sqrt(corrected(paint, 10**18)[1][1, [1, 2], [1, 2]]))
    towards, tilted, side = np.array(sigmas_mm)
    assert np.all(towards > tilted)
    assert np.all(tilted > side)
    # A resting hand's tips, seen from the side, were .13-.2 mm off across and their model .0-.1 mm
    # in depth.
    assert np.all(side < 0.2)


@pytest.mark.parametrize(
    "wxyz", [(0.0, 0.0, 0.0, 0.0), (1e300, 1.0, 0.0, 0.0), (1e-9, 0.0, 0.0, 0.0)]
)
def test_absurd_or_predicted_poses_are_ignored(paint, wxyz):
    paint.note(paint.directions(pose(10**18, wxyz)))
    paint.note(paint.directions(pose(10**18, TOWARDS, source="predicted")))
    assert is_untouched(corrected(paint, 10**18)[0])


def depth_sigmas_m(origin: str, sigma_rad: float | None) -> tuple[float, float]:
    """Along x and z, of a tip that points at the cameras, tilted by half a radian."""
    model = msgspec.structs.replace(default_hand("right"), origin=origin)
    paint = PaintToBone(LANDMARKS, {"right": model}, tuple(SyntheticRig().rig().values()))
    paint.note(paint.directions(pose(10**18, TOWARDS, sigma_rad=sigma_rad)))
    variances = corrected(paint, 10**18)[1][1]
    return float(np.sqrt(variances[0, 0])), float(np.sqrt(variances[2, 2]))


def test_an_unsure_direction_makes_an_unsure_tip():
    """As unsure as without a direction, or nearly so, once it may be any."""
    for axis in range(2):
        told = [depth_sigmas_m("simulated", sigma)[axis] for sigma in (0.02, 0.1, 0.3, 0.8)]
        assert told[0] < told[1] < min(told[2:])
    assert depth_sigmas_m("simulated", 0.05)[1] < depth_sigmas_m("simulated", None)[1]
    unknown = 0.29 * 6.8e-3
    assert depth_sigmas_m("simulated", 0.02)[1] < 0.55 * unknown
    assert 0.7 * unknown < depth_sigmas_m("simulated", 1.5)[1] < 2.0 * unknown


def test_sigmas_hold_a_direction_that_is_off(random_fingers):
    """Ray-cast tips, corrected by directions that are off by what the pose says."""
    random, squares = np.random.default_rng(2), []
    model = msgspec.structs.replace(default_hand("right"), origin="simulated")
    paint = PaintToBone(LANDMARKS, {"right": model}, tuple(SyntheticRig().rig().values()))
    for point, direction, located in random_fingers(120, hidden=0.5):
        axis = np.cross(direction, random.normal(size=3))
        off = rotation_from_vector(random.normal(0.0, 0.25) * axis / np.linalg.norm(axis))
        away = rotation_between(np.array([0.0, 0.0, -1.0]), off @ direction)
        # A digit's angles share the blame with the wrist.
        told = pose(10**18, tuple(quaternion_from_rotation(away).tolist()), sigma_rad=0.15)
        paint.note(paint.directions(told))
        places, covariances = corrected(paint, 10**18, np.array([POSITIONS[0], located]))
        error = places[1] - point
        squares.append(error @ np.linalg.solve(covariances[1], error) / 3.0)
    assert 0.2 < np.mean(squares) < 2.0


def rotation_between(a, b):
    """A rotation that turns unit vector a to unit vector b."""
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    return rotation_from_vector(axis / max(sine, 1e-9) * np.arctan2(sine, a @ b))


def test_a_finger_that_was_not_measured_makes_an_unsure_tip():
    for axis in range(2):
        known, measured, table = (
            depth_sigmas_m(origin, 0.05)[axis] for origin in ("simulated", "measured", "tables")
        )
        assert known <= measured <= table
    assert known < measured < table


def test_the_compiled_turn_agrees_with_the_plain_one():
    random = np.random.default_rng(5)
    vectors, quaternions = random.normal(size=(20, 3)), random.normal(size=(20, 4))
    plain = [
        rotation_from_quaternion(q) @ vector for q, vector in zip(quaternions, vectors, strict=True)
    ]
    turned = np.empty((20, 3))
    for vector, quaternion, out in zip(vectors, quaternions, turned, strict=True):
        turn_vector(vector, quaternion, out)
    np.testing.assert_allclose(turned, plain, atol=1e-12)
