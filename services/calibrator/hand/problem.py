"""A hand calibration as a least-squares problem: landmarks of many frames, a few segments, one
hand. Pure.

A segment is some seconds of one exercise: one digit (or one joint of all) varies, the others are
held still. A constant angle has one unknown per segment, a varying one has one per frame, and every
last joint follows its neighbour by the hand's coupling ratio plus a constant of the segment. So few
unknowns per frame avoid the bias of adjusting everything at once: with twenty free angles a frame a
long finger, bent, explains noise that a short one, straight, cannot, and bones come out a tenth too
long (Neyman & Scott 1948 on incidental parameters). A landmark that is missing in a frame has the
weight 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from services.calibrator.hand.hand_parameters import HandGeometry, HandParameters

# Angles of a hand; unknowns of a wrist's pose.
ANGLES, WRIST = 20, 6
# A joint that may vary by more has no constant part: where it is in one frame says nothing of the
# next.
_FREE_RAD = np.deg2rad(30.0)
# Information (1/rad^2) that keeps a constant which is no unknown at zero.
_FIXED = 1e12


@dataclass(frozen=True)
class Segment:
    """Frames of one exercise.

    varying: the angles (0..19) that change, and by how much (standard deviation, rad). expected and
    sd (20,) rad: the prior of the constant angles; of a last joint (index % 4 == 3) that of its
    deviation from ratio * the joint before it.
    """

    name: str
    count: int
    varying: dict[int, float]
    expected: Array
    sd: Array


class Poses(NamedTuple):
    """The hand in every frame: wrist in the rig frame, varying and constant angles in rad.

    n frames, s segments; f is the largest number of varying angles, fewer are padded with zeros.
    """

    rotations: Array  # (n, 3, 3)
    positions: Array  # (n, 3)
    varying: Array  # (n, f)
    constant: Array  # (s, 20)

    def updated(self, step: Array, constant_step: Array) -> Poses:
        """After a step (n, 6 + f), wrist first and in its own frame, and one of the constant angles
        (s, 20).
        """
        rotations = np.array([rotation_from_vector(v) for v in step[:, :3]])
        shifts = np.einsum("nij,nj->ni", self.rotations, step[:, 3:WRIST])
        return Poses(
            self.rotations @ rotations,
            self.positions + shifts,
            self.varying + step[:, WRIST:],
            self.constant + constant_step,
        )


class Problem:
    """What was measured: points (n, m, 3) in the rig frame, weights 1/sigma^2 (n, m, 3), 0 where
    missing; frames in the order of segments.
    """

    def __init__(
        self,
        parameters: HandParameters,
        points: Array,
        weights: Array,
        segments: tuple[Segment, ...],
    ) -> None:
        self.parameters, self.segments = parameters, segments
        self.points, self.weights = points, weights
        counts = [segment.count for segment in segments]
        self.segment_of = np.repeat(np.arange(len(segments)), counts)
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.max_varying = max(len(segment.varying) for segment in segments)
        # Which angle each varying unknown of a segment is, as a matrix (s, 20, f); columns beyond a
        # segment's own are zero.
        self.selection = np.zeros((len(segments), ANGLES, self.max_varying))
        # 1/sd^2 of the varying unknowns (s, f); a padding column belongs to no angle: its equation
        # says that it stays zero.
        self.varying_information = np.ones((len(segments), self.max_varying))
        for s, segment in enumerate(segments):
            columns = np.arange(len(segment.varying))
            self.selection[s, list(segment.varying), columns] = 1.0
            self.varying_information[s, columns] = np.array(list(segment.varying.values())) ** -2.0
        is_constant = np.array(
            [[s.varying.get(angle, 0.0) < _FREE_RAD for angle in range(ANGLES)] for s in segments]
        )
        expected = np.array([segment.expected for segment in segments])
        information = np.array([segment.sd for segment in segments]) ** -2.0
        self.expected = np.where(is_constant, expected, 0.0)
        self.constant_information = np.where(is_constant, information, _FIXED)

    def sum_by_segment(self, values: Array) -> Array:
        """Sums over the frames of each segment; (n, ...) -> (s, ...)."""
        return np.add.reduceat(values, self._first, axis=0)

    def angles(self, measures: HandGeometry, poses: Poses) -> Array:
        """All angles, (n, 5, 4)."""
        varying = np.einsum("naf,nf->na", self.selection[self.segment_of], poses.varying)
        own = poses.constant[self.segment_of] + varying
        return (own @ coupling_matrix(measures.ratios).T).reshape(-1, 5, 4)


def coupling_matrix(ratios: Array) -> Array:
    """All angles from the unknown ones, (20, 20).

    The last angle of a digit is ratio (5,) times the one before plus its own.
    """
    M = np.eye(ANGLES)
    last = 4 * np.arange(5) + 3
    M[last, last - 1] = ratios
    return M
