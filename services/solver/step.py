"""The solver's step: landmarks of one hand in, its full pose out.

whole_hand/ finds the wrist's pose (and about how every digit is bent) from all landmarks together;
config.solver.method decides how each digit's angles are then found (finger/). None until the wrist
and three tips were seen in one message. Late messages: the prior is blurred by the time that
passed; a second's gap starts anew. Missing landmarks: fewer equations, and what is not measured
says `predicted`. A hand that was never measured: the tables' hand at the scale of rig.toml, and
sigmas that say so (model_error.py). Absurd points are dropped (whole_hand/point_check.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress

import numpy as np

from rhot.files.config import RigConfig
from rhot.hand import HandModel, HandName, joint_radii_m
from rhot.messages import HandPoints, HandPose, JointSource
from services.solver.finger.solve_fingers import FingerSolution, solve_fingers, tips_in_wrist
from services.solver.maths.kinematics import hand_frames
from services.solver.model_check import check_model
from services.solver.model_error import ModelError
from services.solver.pose_message import (
    Skeleton,
    hand_pose,
    joint_sources,
    pose_uncertainty,
    rounded,
    rounded_within_limits,
)
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.hand_tracker import MIN_LANDMARKS, HandTracker
from services.solver.whole_hand.landmarks import Observed, hand_landmarks
from services.solver.whole_hand.point_check import usable_points

# Sets of measured landmarks whose joints' sources are remembered: fingers come and go.
_MAX_SETS = 256


class SolverStep:
    """All configured hands; deterministic: the same messages give the same poses."""

    def __init__(self, config: RigConfig, hands: Mapping[HandName, HandModel]) -> None:
        """Raises CalibrationError when a hand model cannot be solved with."""
        self._hands = {name: _Hand(config, model) for name, model in hands.items()}

    def step(self, points: HandPoints) -> HandPose | None:
        """The pose at the instant of points, or None while that hand has not been found.

        None too for a hand that is not configured.
        """
        hand = self._hands.get(points.hand)
        return hand.step(points) if hand is not None else None

    def challenge_due(self, hand: HandName) -> bool:
        """Whether challenge() of that hand has something to do."""
        return self._hands[hand].tracker.challenge_due

    def challenge(self, hand: HandName) -> None:
        """Look for another pose that explains the points as well, where that is due: 5 ms.

        For when the pose is out; the next step() does it where nobody has.
        """
        self._hands[hand].tracker.challenge()


class _Hand:
    """One hand: its model in the forms the kernels use, and its tracker."""

    def __init__(self, config: RigConfig, model: HandModel) -> None:
        check_model(model)
        self._settings = config.solver
        self._landmarks = hand_landmarks(model)
        self.tracker = HandTracker(model, self._landmarks)
        self._model_error = ModelError(model, self.tracker.chains, self._landmarks)
        # By the landmarks that were measured.
        self._known_sources: dict[frozenset[str], list[JointSource]] = {}
        self._radii: list[float] = rounded(joint_radii_m(model))

    def step(self, points: HandPoints) -> HandPose | None:
        observed = self._model_error.widened(usable_points(points, self._landmarks))
        estimate = self.tracker.track(points.stamp_ns, observed)
        if estimate is None:
            return None
        fingers = self._solve_fingers(estimate, observed)
        limits = self.tracker.chains.limits_rad
        variances = self._model_error.pose_variances(
            points.stamp_ns, estimate, observed.names, self.tracker.fitted
        )
        return hand_pose(
            points,
            self._settings.method,
            self._skeleton(estimate, fingers, observed),
            fingers,
            pose_uncertainty(variances, limits),
        )

    def _solve_fingers(self, estimate: HandEstimate, observed: Observed) -> FingerSolution:
        """The digits by the configured method, angles rounded as they go out."""
        chains = self.tracker.chains
        tips = tips_in_wrist(
            estimate.rotation,
            estimate.position_m,
            self._landmarks.places(observed.names).tip,
            observed.points_m,
            observed.covariances_m2,
            observed.measured,
        )
        found = solve_fingers(self._settings, chains, estimate.angles_rad, tips)
        angles = rounded_within_limits(found.angles_rad, chains.limits_rad)
        return FingerSolution(angles, found.residual_m, found.iterations, found.status)

    def _skeleton(
        self, estimate: HandEstimate, fingers: FingerSolution, observed: Observed
    ) -> Skeleton:
        """All joints at the estimate's wrist and the fingers' angles, and where each comes from."""
        positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
        hand_frames(
            self.tracker.chains,
            estimate.rotation,
            estimate.position_m,
            fingers.angles_rad,
            positions,
            rotations,
        )
        measured = frozenset(compress(observed.names, observed.measured.tolist()))
        return Skeleton(positions, rotations, self._radii, self._sources(measured))

    def _sources(self, measured: frozenset[str]) -> list[JointSource]:
        """Where each joint comes from; the same few sets of landmarks come again and again."""
        known = self._known_sources.get(measured)
        if known is None:
            located = len(measured) >= MIN_LANDMARKS
            digits = {self._landmarks[name].digit for name in measured}
            known = joint_sources(measured, located, [row in digits for row in range(5)])
            if len(self._known_sources) < _MAX_SETS:
                self._known_sources[measured] = known
        return known
