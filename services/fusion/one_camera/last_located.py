"""A landmark that one camera sees alone: known across its ray, and along it by its hand.

The filter goes on with the velocity it had. Within some tenths of a second that velocity's error
takes the landmark decimetres along the ray, metres within seconds, far outside what its covariance
says, as all of it rests on one straight line through a turn. So the distance from the camera is
told as that of the last sight by two cameras, weighed against what else tells it: the shape of its
hand, where two cameras see others of the hand (carried_shape.py), or else the filter. It is as
unsure as hands move, in the second case as that hand lately did (distance_motion.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import Layout, unowned
from services.fusion.arrays import Bools, Ints
from services.fusion.method import Estimates
from services.fusion.one_camera.carried_shape import (
    LocatedShapes,
    carry_shape,
    no_shapes,
    note_shapes,
)
from services.fusion.one_camera.distance_motion import (
    DistanceMotion,
    learn_motion,
    moved_sigma_m,
    no_motion,
)
from services.fusion.one_camera.kept_shape import ShapeMemory, empty_memory, learn_deformation

Estimate = tuple[Array, Array]  # position (3,) and covariance (3, 3), rig frame

# How far a hand's distance changes, 1 sigma, beside what a shape tells: as fast as this at first,
# never more than so far. Tuning motions (sinusoids of .5 m/s, Leap grab, the glove's first 20 s,
# stop and go at 14 m/s^2), one camera gone for 2 s. As the hand itself lately moved is no better
# here: three tips of the glove 3.0 -> 10.0 mm.
_RATE_M_S, _FARTHEST_M = 0.35, 0.12
# The filter's own sigma along the ray is worth half in so long: alone, and where a shape tells the
# distance. Tuning motions of benchmarks/one_camera.py, three tips, .5 s, geometric mean of RMS:
# with .1 for .05 there 12.0 for 10.6 mm, .03 no better.
_TRUST_S, _BESIDE_SHAPE_S = 0.1, 0.05
# How far along the ray a shape is looked for from the last distance, 1 sigma.
_REACH_M = 1.0


class _Learnt(NamedTuple):
    """What is learnt from what two cameras see."""

    shapes: LocatedShapes
    memory: ShapeMemory  # how the hands deformed lately
    motion: DistanceMotion
    hand: Ints  # (L,) whose each landmark is


_LEARNT = Layout()
_learnt_at = _LEARNT.at


class LastLocated:
    """Where L landmarks were when two cameras saw each last, and what that tells of them now."""

    def __init__(self, hand: Ints, eye_rig: Array, span_s: float) -> None:
        """hand (L,): whose each landmark is; eye_rig (3,): the middle of the cameras.

        span_s: from one instant to the next, usually.
        """
        self._hand, self._span_s = hand, span_s
        # The camera that saw each alone last, -1: two saw it since. A frame that is lost is no
        # reason to tell what nobody sees as the filter has it, metres off along a ray.
        self.alone_with = np.full(hand.size, -1)
        self._shapes = no_shapes(hand.size)
        self._memory = empty_memory(hand.size, eye_rig)
        self._motion = no_motion(hand.size)
        self._learnt = _LEARNT.pack(_Learnt(self._shapes, self._memory, self._motion, hand))
        # An instant that is not learnt from yet, and who was located.
        self._taken: tuple[float, Bools, Estimates] | None = None

    def take(self, time_s: float, estimates: Estimates) -> None:
        """Remember what two cameras see at an instant.

        That takes a while, which nobody waits for: settle() does it, before the next instant is
        taken and as long as the places of estimates are what they were.
        """
        self._taken = time_s, estimates.found & estimates.measured, estimates

    def settle(self) -> None:
        """Learn from what was taken last."""
        if self._taken is not None:
            time_s, located, estimates = self._taken
            self._taken = None
            places = estimates.positions_m, estimates.covariances_m2
            _note(self._learnt.address, located, *places, time_s, self._span_s)
            self.alone_with[located] = -1

    def tell_alone(self, time_s: float, centres_rig: Array, estimates: Estimates) -> None:
        """Estimates of all landmarks that one camera sees alone, or did last, in place.

        centres_rig (C, 3): of the cameras.
        """
        self.settle()
        seen = estimates.found & ~estimates.measured & estimates.seen_by.any(axis=1)
        self.alone_with[seen] = estimates.seen_by[seen].argmax(axis=1)
        alone = estimates.found & ~estimates.measured & (self.alone_with >= 0)
        located = estimates.found & estimates.measured
        centres = centres_rig[self.alone_with]  # (L, 3) of the camera that sees each alone
        means, covs = estimates.positions_m, estimates.covariances_m2
        memory = self._memory, self._span_s
        places = means.copy(), covs.copy()
        rows = np.flatnonzero(alone).tolist()
        for row in rows:
            places[0][row], places[1][row] = self._ray(
                row, time_s, (means[row], covs[row]), centres[row]
            )
        for row in rows:
            shape = np.empty(3), np.empty((3, 3))
            now = (time_s, *places)
            if carry_shape(self._shapes, memory, self._hand, row, (located, alone), now, shape):
                sigma_m = min(_RATE_M_S * (time_s - self._shapes.time_s[row]), _FARTHEST_M)
                means[row], covs[row] = self._weighed(row, time_s, shape, centres[row], sigma_m)
            else:
                estimate = means[row], covs[row]
                means[row], covs[row] = self.told(row, time_s, estimate, centres[row])

    def told(self, row: int, time_s: float, estimate: Estimate, centre_rig: Array) -> Estimate:
        """The filter's estimate of a landmark by one camera at centre_rig (3,), its distance held.

        As it is if two cameras never saw the landmark.
        """
        worn = self._worn(row, time_s, estimate, centre_rig, _TRUST_S)
        sigma_m = moved_sigma_m(self._motion, row, time_s - self._shapes.time_s[row])
        return self._weighed(row, time_s, worn, centre_rig, sigma_m)

    def _ray(self, row: int, time_s: float, estimate: Estimate, centre_rig: Array) -> Estimate:
        """The filter's estimate with hardly anything said of the distance."""
        worn = self._worn(row, time_s, estimate, centre_rig, _BESIDE_SHAPE_S)
        return self._weighed(row, time_s, worn, centre_rig, _REACH_M)

    def _worn(
        self, row: int, time_s: float, estimate: Estimate, centre_rig: Array, trust_s: float
    ) -> Estimate:
        """The filter's estimate, less sure along the ray the longer two cameras did not see it."""
        age_s = time_s - self._shapes.time_s[row]
        if not 0.0 <= age_s < np.inf:
            return estimate
        position, cov = estimate
        along = (position - centre_rig) / float(np.linalg.norm(position - centre_rig))
        more = (1.0 + age_s / trust_s) ** 2 - 1.0
        return position, cov + more * float(along @ cov @ along) * np.outer(along, along)

    def _weighed(
        self, row: int, time_s: float, estimate: Estimate, centre_rig: Array, sigma_m: float
    ) -> Estimate:
        """An estimate weighed along the ray against the last distance, that unsure; else as it is.

        It is scaled to the told distance, so an angle stays an angle.
        """
        distance = float(np.linalg.norm(self._shapes.places[row, row] - centre_rig))
        if not (time_s >= self._shapes.time_s[row] and np.isfinite(distance)):
            return estimate
        position, cov = estimate
        ray = position - centre_rig
        own = float(np.linalg.norm(ray))
        along = ray / own
        own_variance = float(along @ cov @ along)
        held_variance = sigma_m**2 + 1e-6
        variance = own_variance * held_variance / (own_variance + held_variance)
        told = variance * (own / own_variance + distance / held_variance)
        across = np.eye(3) - np.outer(along, along)
        told_cov = (told / own) ** 2 * (across @ cov @ across) + variance * np.outer(along, along)
        return centre_rig + told * along, told_cov


@njit(cache=True, error_model="numpy")
def _note(
    address: int, located: Bools, places: Array, covs: Array, time_s: float, span_s: float
) -> None:
    """Remember the places (L, 3), (L, 3, 3) of those that two cameras see (L,) at an instant.

    address: of _Learnt; span_s: from one instant to the next.
    """
    learnt: _Learnt = _learnt_at(address)
    located, places, covs = unowned((located, places, covs))
    memory, shapes = learnt.memory, learnt.shapes
    learn_motion(learnt.motion, located, places, memory.eye, time_s, span_s)
    note_shapes(shapes, located, places, covs, time_s)
    learn_deformation(memory, learnt.hand, located, places, time_s, span_s)
