"""Where painted landmarks sit on the hand, and what was measured of them, as arrays."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from rhot.hand import JOINTS, TIPS, HandModel, landmark_point
from rhot.kernels.packed import Layout, Packed
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import CHAINS, HandChains, hand_chains
from services.solver.maths.kinematics import hand_frames

Bools = npt.NDArray[np.bool_]
# Lists of names whose places are remembered: fingers come and go.
MAX_LISTS = 256


@dataclass(frozen=True)
class Landmark:
    """Where a painted landmark is fixed to the hand."""

    joint: int  # index into JOINTS
    digit: int  # row of its chain; -1: fixed to the wrist frame
    depth: int  # how many of the chain's four angles move it
    offset_m: Array  # (3,) in the joint's frame; in the wrist frame where digit is -1
    reach_m: float  # the furthest that it can be from the wrist joint

    @property
    def is_tip(self) -> bool:
        """Whether it is the paint on the end of a digit."""
        return self.digit >= 0 and bool(self.joint == CHAINS[self.digit, 3])


@dataclass(frozen=True)
class Observation:
    """One measured landmark."""

    point_m: Array  # (3,) rig frame
    covariance_m2: Array  # (3, 3) of its error, rig frame
    measured: bool  # whether cameras saw all of it; else fusion predicted some of it


class Observed(Mapping[str, Observation]):
    """Measured landmarks by name, kept as arrays: what every message brings."""

    def __init__(
        self, names: Sequence[str], points_m: Array, covariances_m2: Array, measured: Bools
    ) -> None:
        """points_m (m, 3), covariances_m2 (m, 3, 3), measured (m,): as in Observation."""
        self.names = tuple(names)
        self.points_m = points_m
        self.covariances_m2 = covariances_m2
        self.measured = measured

    @classmethod
    def of(cls, observed: Mapping[str, Observation]) -> Observed:
        """The same landmarks as arrays."""
        if isinstance(observed, Observed):
            return observed
        seen = observed.values()
        return cls(
            tuple(observed),
            np.array([one.point_m for one in seen], dtype=np.float64).reshape(-1, 3),
            np.array([one.covariance_m2 for one in seen], dtype=np.float64).reshape(-1, 3, 3),
            np.array([one.measured for one in seen], dtype=np.bool_),
        )

    def __getitem__(self, name: str) -> Observation:
        if name not in self.names:
            raise KeyError(name)
        n = self.names.index(name)
        return Observation(self.points_m[n], self.covariances_m2[n], bool(self.measured[n]))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


class Places(NamedTuple):
    """Where m landmarks sit, as arrays; the fields are those of Landmark."""

    joint: Integers  # (m,)
    digit: Integers  # (m,)
    depth: Integers  # (m,)
    offset_m: Array  # (m, 3)
    reach_m: Array  # (m,)
    tip: Integers  # (m,) row of the digit whose tip it is, -1 of other landmarks


PLACES = Layout()
places_at = PLACES.at


class Landmarks(dict[str, Landmark]):
    """Every landmark that a hand's model has paint for, by name."""

    def __init__(self, landmarks: Mapping[str, Landmark]) -> None:
        super().__init__(landmarks)
        self._places: dict[tuple[str, ...], Packed] = {}
        # Against the model's.
        self._size = 1.0

    def places(self, names: tuple[str, ...]) -> Places:
        """Where landmarks sit."""
        places: Places = self.packed(names).parts
        return places

    def packed(self, names: tuple[str, ...]) -> Packed:
        """The same for kernels (PLACES); the same few lists of names come with every message."""
        known = self._places.get(names)
        if known is None:
            known = PLACES.pack(self._placed(names))
            # Names come from the network, in any order: the memory for them is bounded.
            if len(self._places) < MAX_LISTS:
                self._places[names] = known
        return known

    def resize(self, size: float) -> None:
        """Have the hand so many times as large as the model from now on, for all who have places
        of it; paint on tips is as long as it was.
        """
        self._size = size
        for names, packed in self._places.items():
            new, known = self._placed(names), packed.parts
            known.offset_m[:], known.reach_m[:] = new.offset_m, new.reach_m

    def _placed(self, names: tuple[str, ...]) -> Places:
        where, size = [self[name] for name in names], self._size
        offset_m = [one.offset_m * (1.0 if one.is_tip else size) for one in where]
        return Places(
            joint=np.array([landmark.joint for landmark in where], dtype=np.int64),
            digit=np.array([landmark.digit for landmark in where], dtype=np.int64),
            depth=np.array([landmark.depth for landmark in where], dtype=np.int64),
            offset_m=np.array(offset_m, dtype=np.float64).reshape(-1, 3),
            reach_m=np.array([size * landmark.reach_m for landmark in where], dtype=np.float64),
            tip=np.array([TIPS.index(n) if n in TIPS else -1 for n in names], dtype=np.int64),
        )


class Observations(NamedTuple):
    """m measured landmarks as arrays; the fields are those of Landmark and Observation.

    whitening @ (an error in the rig frame) has unit covariance, whichever way the rig's axes lie.
    """

    joint: Integers  # (m,)
    digit: Integers  # (m,)
    depth: Integers  # (m,)
    offset_m: Array  # (m, 3)
    point_m: Array  # (m, 3) rig frame
    whitening: Array  # (m, 3, 3) 1/m, lower triangles


@njit(cache=True, inline="always")
def observations_of(places: Places, points_m: Array, whitening: Array) -> Observations:
    """Landmarks that sit at places, measured at points (m, 3); whitening as in Observations."""
    return Observations(
        places.joint, places.digit, places.depth, places.offset_m, points_m, whitening
    )


@njit(cache=True)
def resized_offsets(observations: Observations, factor: float) -> Array:
    """Offsets (m, 3) of landmarks on a hand so many times as large, as Landmarks.resize has it."""
    offset_m = observations.offset_m.copy()
    for n in range(observations.joint.size):
        row = observations.digit[n]
        if row < 0 or observations.joint[n] != CHAINS[row, 3]:
            offset_m[n] *= factor
    return offset_m


def hand_landmarks(model: HandModel) -> Landmarks:
    """Every landmark that the model has paint for."""
    chains = hand_chains(model)
    # An open hand is at its longest.
    angles = np.clip(np.zeros((5, 4)), chains.limits_rad[:, :, 0], chains.limits_rad[:, :, 1])
    positions, rotations = frames_in_wrist(chains, angles)
    return Landmarks(
        {
            name: _landmark(model, name, landmark_point(model, name, positions, rotations))
            for name in model.paint
        }
    )


def frames_in_wrist(chains: HandChains, angles: Array) -> tuple[Array, Array]:
    """Positions (26, 3) m and rotations (26, 3, 3) of all joints in the wrist frame.

    At angles (5, 4) rad.
    """
    positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
    hand_frames(chains, np.eye(3), np.zeros(3), angles, positions, rotations)
    return positions, rotations


def observation_arrays(
    landmarks: Landmarks, observed: Mapping[str, Observation], misfit_m: float = 0.0
) -> Observations:
    """What was observed, by landmark, joined with where each landmark sits.

    misfit_m: one standard deviation along each axis of where the model puts a landmark, beside that
    of where it was seen.
    """
    seen = Observed.of(observed)
    places = landmarks.places(seen.names)
    return Observations(
        places.joint,
        places.digit,
        places.depth,
        places.offset_m,
        seen.points_m,
        whitening(seen.covariances_m2, misfit_m**2),
    )


def _landmark(model: HandModel, name: str, open_hand_m: Array) -> Landmark:
    """One landmark; open_hand_m (3,): where it is on the open hand, wrist frame."""
    joint = JOINTS.index(name)
    reach = float(np.linalg.norm(open_hand_m))
    offset = np.array(model.paint[name].offset_m)
    found = np.argwhere(joint == CHAINS)
    if len(found):
        row, k = (int(v) for v in found[0])
        return Landmark(joint, row, min(k + 2, 4), offset, reach)
    metacarpal_m = {digit.name: np.array(digit.metacarpal_m) for digit in model.digits}
    if name == "palm":
        offset = offset + 0.5 * (metacarpal_m["middle"] + np.array(model.digits[2].base_m))
    elif name != "wrist":
        offset = offset + metacarpal_m[name.removesuffix("_metacarpal")]  # type: ignore[index]
    return Landmark(joint, -1, 0, offset, reach)


@njit(cache=True)
def whitening(covariances: Array, more_m2: float) -> Array:
    """Inverse Cholesky factors of covariances (m, 3, 3) + more_m2 times the identity; (m, 3, 3)."""
    out = np.zeros_like(covariances)
    for m in range(covariances.shape[0]):
        C, W = covariances[m], out[m]
        a = math.sqrt(C[0, 0] + more_m2)
        b, d = C[1, 0] / a, C[2, 0] / a
        c = math.sqrt(C[1, 1] + more_m2 - b * b)
        e = (C[2, 1] - b * d) / c
        f = math.sqrt(C[2, 2] + more_m2 - d * d - e * e)
        W[0, 0], W[1, 1], W[2, 2] = 1.0 / a, 1.0 / c, 1.0 / f
        W[1, 0] = -b / (a * c)
        W[2, 1] = -e / (c * f)
        W[2, 0] = (b * e / c - d) / (a * f)
    return out
