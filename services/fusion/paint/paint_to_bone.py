"""From the visible centre of paint to the point on the bone axis that stands for the landmark.

Cameras see paint on skin, but what they locate is not a point of the skin. The centroid of a
painted finger tip is set by its outline: where that is the limb of the finger, it passes through
the axis as seen from any camera, so two cameras put the centroid *on the axis*; only the edge where
the paint ends lies on the skin itself. Ray-cast from two cameras 75 mm apart (capsule of radius 6.8
mm painted over 14 mm, 400 random directions, the finger not pointing away), the located centroid
against the middle of the painted axis is

    along the viewing ray, away from the cameras   -.5 +- 2.0 mm
        (within .1 mm alike at .35, .5 and .8 m, and with shading)
        finger along the baseline -2.4 mm, across it -.1 mm, pointing at the cameras +2.1 mm
    across the ray                                 1.5 mm RMS

so there is nothing to push: a push by the radius would be 6.3 mm wrong. What depends on the
finger's direction is taken off when a pose tells it (paint_centroid.py; on rendered scenes the RMS
error fell from .49, 1.17, 1.75 to .23, .35, .91 mm along x, y, z). Without a pose it stays, and the
covariance says so; with one it says how unsure the pose's directions are, and how thick a finger
may be that was never measured. A dab (radius 0) marks the point of the skin under its
middle, but skin falls away from there: the centre of what is seen lies deeper, by `dab_sag_m`
against the skin's normal, whose direction is as unsure as the wrist's. What light, background and
detector do to a centre is systematic_error.py's matter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, JOINT_INDEX, HandModel, HandName
from rhot.messages import HandPose
from services.fusion.arrays import Bools, Ints
from services.fusion.intake.observations import Landmark
from services.fusion.paint.known_paint import LONG_AGO_NS, PAINT, KnownPaint, note_directions
from services.fusion.paint.visible_paint import PaintTables, dab_sag_m, paint_tables

# How thick fingers are against the model's, by HandModel.origin, one standard deviation: measuring
# a hand measures bones. Tuning captures' are within 8 %; with .12 their sigma is a tenth larger.
# (How long the paint is does not matter: paint_centroid.py.)
_RADIUS_SD = {"tables": 0.08, "measured": 0.06}
# What directions were off on average when poses did not say how sure they were.
_UNTOLD_DIRECTION_RAD = 0.12
# Abduction alone turns a finger sideways. Against the root mean square over a digit's angles, which
# poses tell, its sigma is .45 (tuning captures); directions were off sideways by .3 to .7 of what
# they were about the hinge.
_SIDEWAYS = 0.45
# How much of a finger's taper shows: its flank is seen at a grazing angle where it counts most, and
# blurs away. RMS, 95 % and maximum of unhidden tips at lag 2 (tuning captures, geometric mean over
# those of a plain capsule): .946, .932 and .978 with all of it, .936, .927 and .966 with .8.
_TAPER_SEEN = 0.8
# Hands of the tables taper by .04 to .08. Of a bone hardly longer than thick, it says nothing.
_MOST_TAPER = 0.2
# Landmark of each digit's tip.
_TIP_OF = {digit: f"{digit}_tip" for digit in DIGITS}
# The axis about which a joint bends, in its own frame.
_HINGE = np.array([1.0, 0.0, 0.0])


def _taper(hand: HandModel, landmark: str) -> float:
    """How a painted tip looks to widen away from its end, as visible_paint.paint_tables takes it.

    Its last bone ends in two balls, the far one its radius before the end of the finger.
    """
    for digit in hand.digits:
        if landmark == f"{digit.name}_tip":
            near_m, far_m = digit.radii_m[2:]
            length_m = max(digit.lengths_m[2] - far_m, 1e-3)
            return _TAPER_SEEN * min(max((near_m - far_m) / length_m, 0.0), _MOST_TAPER)
    return 0.0


def _tables(hand: HandModel, landmark: str) -> PaintTables:
    """What shows of a landmark's paint."""
    paint = hand.paint[landmark]
    return paint_tables(paint.radius_m, paint.extent_m, _taper(hand, landmark))


def _hands_of_unknown_shape(
    landmarks: tuple[Landmark, ...], hands: Mapping[HandName, HandModel]
) -> Ints:
    """Which hand each landmark is of (L,), from 0; -1 of hands that are known exactly."""
    names = list(hands)
    of = [
        names.index(one.hand) if hands[one.hand].origin in _RADIUS_SD else -1 for one in landmarks
    ]
    return np.array(of, dtype=np.int64)


class Directions(NamedTuple):
    """Where the fingers of a hand point, and the skin under its dabs, as a pose says."""

    hand: HandName
    stamp_ns: int
    rows: Ints  # (n,) landmarks
    directions: Array  # (n, 3)
    hinges: Array  # (n, 3) the axis about which a finger bends
    sigmas_rad: Array  # (n, 2) of the directions, about the hinge and sideways
    misfit: float  # how badly the hand fits its bones, squared; 1 is usual, or not told


class PaintToBone:
    """What is known of the paint of every landmark, and of the way the fingers point."""

    def __init__(
        self,
        landmarks: tuple[Landmark, ...],
        hands: Mapping[HandName, HandModel],
        cameras: tuple[Camera, ...],
    ) -> None:
        paints = [hands[landmark.hand].paint[landmark.name] for landmark in landmarks]
        radii_m = np.array([paint.radius_m for paint in paints])  # (L,)
        dabs_m = np.where(radii_m == 0.0, [paint.extent_m for paint in paints], 0.0)  # across
        # Which landmarks are painted all round (L,), as tips are.
        self.round: Bools = radii_m > 0.0
        # Which landmarks are paint of some size (L,), not points.
        self.extended: Bools = np.array(
            [paint.radius_m > 0.0 or paint.extent_m > 0.0 for paint in paints], dtype=bool
        )
        offsets = np.array([paint.offset_m for paint in paints]).reshape(-1, 3)
        limbs_m = np.linalg.norm(offsets, axis=1)
        # Which rows of each hand are extended, with their names and the places of those in a pose.
        self._extended_of: dict[HandName, list[tuple[int, str, int]]] = {
            hand: [
                (row, landmark.name, JOINT_INDEX[landmark.name])
                for row, landmark in enumerate(landmarks)
                if landmark.hand == hand and self.extended[row]
            ]
            for hand in hands
        }
        # In its joint's frame (L, 3): the way a painted tip points, the outward normal of a dab's
        # skin; and how deep a dab's middle lies under the landmark (L,).
        normals = offsets / np.maximum(limbs_m, 1e-9)[:, None]
        self._outwards = np.where(self.round[:, None], [0.0, 0.0, -1.0], normals)
        sags_m = np.array(list(map(dab_sag_m, 0.5 * dabs_m, limbs_m)))
        tables = [_tables(hands[one.hand], one.name) for one in landmarks]
        self.known = KnownPaint(
            radii_m=radii_m,
            sags_m=sags_m,
            shifts_m=np.array([one.shifts_m for one in tables]).reshape(len(paints), -1),
            areas_m2=np.array([one.areas_m2 for one in tables]).reshape(len(paints), -1),
            radius_sds=np.array([_RADIUS_SD.get(hands[one.hand].origin, 0.0) for one in landmarks]),
            directions=np.zeros((len(landmarks), 3)),
            hinges=np.zeros((len(landmarks), 3)),
            direction_sigmas=np.zeros((len(landmarks), 2)),
            misfits=np.ones(len(landmarks)),
            direction_shares=np.ones(len(landmarks)),
            shape_sds=np.zeros(len(landmarks)),
            hands=_hands_of_unknown_shape(landmarks, hands),
            turns_rad_s=np.zeros((len(landmarks), 3)),
            stamps_ns=np.full(len(landmarks), LONG_AGO_NS),
            viewpoint_rig=np.mean([camera.centre_rig for camera in cameras], axis=0),
        )
        self._packed = PAINT.pack(self.known)

    def reset(self) -> None:
        """Time starts anew: no direction is known."""
        self.known.stamps_ns[:] = LONG_AGO_NS

    def directions(self, pose: HandPose) -> Directions:
        """A solved hand's directions: of fingers, -z of each joint, and of dabs' skin."""
        sigma_of = {_TIP_OF[finger.name]: finger.sigma_rad for finger in pose.fingers}
        rows: list[int] = []
        numbers: list[float] = []
        for row, name, place in self._extended_of.get(pose.hand, []):
            joint = pose.joints[place]
            # A pose of another order of joints than OpenXR's tells nothing.
            told = joint.name == name and joint.source != "predicted"
            if told and 0.4 < max(map(abs, joint.orientation_wxyz)) < 1.1:
                rows.append(row)
                # A dab's angles are the hand's alone.
                finger_rad = sigma_of.get(name, 0.0)
                numbers += joint.orientation_wxyz
                numbers.append(math.nan if finger_rad is None else finger_rad)
        of, n = np.array(rows, dtype=np.int64), len(rows)
        wrist_rad = math.nan if pose.wrist_sigma_rad is None else pose.wrist_sigma_rad
        # To be filled: an array that a kernel returns costs .6 us, one that it is given .2.
        aims = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 2))
        turn_with_joints(np.array(numbers), wrist_rad, of, self._outwards, *aims)
        misfit = 1.0 if pose.model_misfit is None else pose.model_misfit
        return Directions(pose.hand, pose.stamp_ns, of, *aims, misfit)

    def note(self, told: Directions) -> None:
        """Remember a solved hand's directions."""
        note_directions(
            self._packed.address,
            told.rows,
            told.directions,
            told.hinges,
            told.sigmas_rad,
            told.misfit,
            told.stamp_ns,
        )


@njit(cache=True)
def turn_with_joints(
    numbers: Array,
    wrist_rad: float,
    rows: Ints,
    outwards: Array,
    directions: Array,
    hinges: Array,
    sigmas_rad: Array,
) -> None:
    """Directions and hinges (n, 3) of the joints of landmarks (n,), and how sure they are (n, 2).

    numbers (5 n,): of each joint its orientation, a quaternion wxyz of any length, and one standard
    deviation of each of its digit's angles, 0 of a dab; wrist_rad: the length of the wrist's error,
    three axes of it; NaN where the pose does not say. outwards (L, 3) of all landmarks, in their
    joints' frames.
    """
    for n in range(rows.size):
        q, finger_rad = numbers[5 * n : 5 * n + 4], numbers[5 * n + 4]
        turn_vector(outwards[rows[n]], q, directions[n])
        turn_vector(_HINGE, q, hinges[n])
        if math.isnan(wrist_rad) or math.isnan(finger_rad):
            sigmas_rad[n] = _UNTOLD_DIRECTION_RAD
        else:
            of_hand = wrist_rad / math.sqrt(3.0)
            sigmas_rad[n, 0] = math.hypot(of_hand, finger_rad)
            sigmas_rad[n, 1] = math.hypot(of_hand, _SIDEWAYS * finger_rad)


@njit(cache=True)
def turn_vector(vector: Array, q: Array, out: Array) -> None:
    """A vector (3,) turned by a quaternion wxyz (4,) of any length, to out (3,).

    As rhot.geometry.transforms.rotation_from_quaternion turns it.
    """
    length = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    w, x, y, z = q[0] / length, q[1] / length, q[2] / length, q[3] / length
    a, b, c = vector
    out[0] = (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c
    out[1] = 2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c
    out[2] = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c
