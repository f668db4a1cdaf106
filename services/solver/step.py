"""The solver's step: landmarks of one hand in, its full pose out.

whole_hand.py finds the wrist's pose (and about how every digit is bent) from all markers together;
config.solver.method decides how each digit's angles are then found (fingers.py). None until the
wrist and three tips were seen in one message. Late messages: the belief is blurred by the time that
passed; a second's gap starts anew. Missing markers: fewer equations, and what is not measured says
`predicted`. A hand that was never measured: the tables' hand at the scale of rig.toml. Absurd
points are dropped (screen.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.hand import DIGITS, TIPS, HandModel, HandName, joint_radii_m
from rhot.messages import HandPoints, HandPose
from services.solver.finger.solve_fingers import Fingers, Tip, solve_fingers
from services.solver.maths.kinematics import hand_frames
from services.solver.pose_message import (
    Skeleton,
    hand_pose,
    rounded,
    rounded_inside,
    sources,
    spread_of,
)
from services.solver.whole_hand.hand_tracker import ENOUGH, HandTracker, Look
from services.solver.whole_hand.point_check import Seen, places, usable


class SolverStep:
    """All configured hands; deterministic: the same messages give the same poses."""

    def __init__(self, config: RigConfig, hands: Mapping[HandName, HandModel]) -> None:
        """Raises CalibrationError when a hand model cannot be solved with."""
        self._hands = {name: _Hand(config, model) for name, model in hands.items()}

    def step(self, points: HandPoints) -> HandPose | None:
        """The pose at the instant of points, or None while that hand has not been found (or is none
        of ours).
        """
        hand = self._hands.get(points.hand)
        return hand.step(points) if hand is not None else None


class _Hand:
    """One hand: its model in the forms the kernels use, and its tracker."""

    def __init__(self, config: RigConfig, model: HandModel) -> None:
        _check(model)
        self._settings = config.solver
        self._known = places(model)
        self._tracker = HandTracker(model, self._known)
        self._radii: list[float] = rounded(joint_radii_m(model))

    def step(self, points: HandPoints) -> HandPose | None:
        seen = usable(points, self._known)
        look = self._tracker.look(points.stamp_ns, seen)
        if look is None:
            return None
        measured = {name for name, landmark in seen.items() if landmark.measured}
        fingers = self._fingers(look, seen)
        chains = self._tracker.chains
        positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
        hand_frames(
            chains, look.rotation, look.position_m, fingers.angles_rad, positions, rotations
        )
        located = len(measured) >= ENOUGH
        solved = [any(self._known[name].digit == row for name in measured) for row in range(5)]
        skeleton = Skeleton(positions, rotations, self._radii, sources(measured, located, solved))
        return hand_pose(
            points,
            self._settings.method,
            skeleton,
            fingers,
            spread_of(look.covariance, chains.limits_rad),
        )

    def _fingers(self, look: Look, seen: Mapping[str, Seen]) -> Fingers:
        chains = self._tracker.chains
        tips = {
            digit: _tip(look, seen[name])
            for digit, name in zip(DIGITS, TIPS, strict=True)
            if name in seen
        }
        found = solve_fingers(self._settings, chains, look.angles_rad, tips)
        angles = rounded_inside(found.angles_rad, chains.limits_rad)
        return Fingers(angles, found.residual_m, found.iterations, found.status)


def _tip(look: Look, landmark: Seen) -> Tip:
    """A painted tip in the wrist frame of a look."""
    sigma = float(np.sqrt(np.mean(landmark.inverse_sigma**-2)))
    return Tip(look.rotation.T @ (landmark.point_m - look.position_m), sigma, landmark.measured)


def _check(model: HandModel) -> None:
    """Everything the kernels rely on; a calibration file may have been written by hand."""
    where = f"hand.{model.hand}.json"
    missing = sorted({"wrist", *TIPS} - set(model.paint))
    if missing:
        raise CalibrationError(
            f"{where}: no paint for {missing}; run `rhot calibrate hand` or copy the tables' hand"
        )
    for digit in model.digits:
        numbers = np.array(
            [
                *digit.metacarpal_m,
                *digit.base_m,
                *digit.base_wxyz,
                *digit.lengths_m,
                digit.coupling,
                digit.coupling_weight,
            ]
        )
        limits = np.array(digit.limits_rad)
        if not (
            np.all(np.isfinite(numbers))
            and np.linalg.norm(digit.base_wxyz) > 1e-6
            and digit.coupling_weight >= 0.0
        ):
            raise CalibrationError(
                f"{where}: {digit.name} has a number that is not finite, no direction, or a negative weight"
            )
        if not (np.all(np.abs(limits) <= np.pi) and np.all(limits[:, 0] <= limits[:, 1])):
            raise CalibrationError(
                f"{where}: limits_rad of {digit.name} must be (low, high) pairs in radians, low <= high, within -pi..pi"
            )
    if [digit.name for digit in model.digits] != list(DIGITS):
        raise CalibrationError(f"{where}: digits must be {', '.join(DIGITS)} in this order")
