"""The solver's step: landmarks of one hand in, its full pose out.

whole_hand/ finds the wrist's pose (and about how every digit is bent) from all landmarks together;
config.solver.method decides how each digit's angles are then found (finger/). None until the wrist
and three tips were seen in one message. Late messages: the prior is blurred by the time that
passed; a second's gap starts anew. Missing landmarks: fewer equations, and what is not measured
says `predicted`. A hand that was never measured: the tables' hand at the scale of rig.toml, which
is learned on (whole_hand/hand_size.py), and sigmas that say so (model_error.py). Absurd points are
dropped (whole_hand/point_check.py).
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from itertools import compress

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import HandModel, HandName, joint_radii_m
from rhot.messages import HandPoints, HandPose, JointSource
from services.solver.error_effect import told_misfit, variances
from services.solver.finger.solve_fingers import DLS, solve_fingers, tips_in_wrist
from services.solver.model_check import check_model
from services.solver.model_error import ErrorsAt, ModelError, landmark_m2
from services.solver.pose_message import hand_pose, joint_sources
from services.solver.pose_numbers import dls_numbers, pose_numbers, rounded
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.hand_size import HandSize
from services.solver.whole_hand.hand_tracker import MIN_LANDMARKS, RESTART_INTERVAL, HandTracker
from services.solver.whole_hand.landmarks import Observed, hand_landmarks
from services.solver.whole_hand.point_check import usable_points

# Sets of measured landmarks whose joints' sources are remembered: fingers come and go.
_MAX_SETS = 256
# Share of the time between restarts by which rigs differ.
_APART = 0.4


class SolverStep:
    """All configured hands; deterministic: the same messages give the same poses."""

    def __init__(self, config: RigConfig, hands: Mapping[HandName, HandModel]) -> None:
        """Raises CalibrationError when a hand model cannot be solved with."""
        self._hands = {name: _Hand(config, name, model) for name, model in hands.items()}

    def step(self, points: HandPoints) -> HandPose | None:
        """The pose at the instant of points, or None while that hand has not been found.

        None too for a hand that is not configured.
        """
        hand = self._hands.get(points.hand)
        return hand.step(points) if hand is not None else None

    def size(self, hand: HandName) -> float | None:
        """How large a hand that nobody measured is by now, against the average adult's if the model
        is the tables' at rig.toml's scale; None: measured.
        """
        return self._hands[hand].size

    def challenge_due(self, hand: HandName) -> bool:
        """Whether challenge() of that hand has something to do."""
        return self._hands[hand].tracker.challenge_due

    def challenge(self, hand: HandName) -> None:
        """Look for another pose that explains the points as well, and for another size of a hand
        that nobody measured, where that is due: 2 ms.

        For when the pose is out; the next step() does it where nobody has.
        """
        self._hands[hand].tracker.challenge()


def restart_interval(name: str) -> int:
    """Updates from one restart of a hand to the next, by the names of rig and hand.

    Rigs of one process whose hands come into view together would all restart at once, every time.
    """
    return round(RESTART_INTERVAL * (1.0 + _APART * (zlib.crc32(name.encode()) / 2**32 - 0.5)))


class _Hand:
    """One hand: its model in the forms the kernels use, and its tracker."""

    def __init__(self, config: RigConfig, name: HandName, model: HandModel) -> None:
        check_model(model)
        self._settings = config.solver
        self._landmarks = hand_landmarks(model)
        self._scale = config.hand[name].scale if name in config.hand else 1.0
        self._size = HandSize(landmark_m2(model)) if model.origin == "tables" else None
        self.tracker = HandTracker(
            model, self._landmarks, restart_interval(f"{config.rig.name}/{name}"), self._size
        )
        self._model_error = ModelError(model, self.tracker.chains)
        # By the landmarks of a message, and which of them were measured.
        self._known_sources: dict[tuple[tuple[str, ...], bytes], list[JointSource]] = {}
        self._radii_m = joint_radii_m(model)
        # As they go out, of a hand so many times as large as the model.
        self._sized = 1.0, [rounded(radius_m) for radius_m in self._radii_m]

    @property
    def size(self) -> float | None:
        """As SolverStep.size."""
        return None if self._size is None else self._scale * self._size.factor

    def step(self, points: HandPoints) -> HandPose | None:
        observed = usable_points(points, self._landmarks, self._model_error.landmark_m2)
        estimate = self.tracker.track(points.stamp_ns, observed)
        if estimate is None:
            return None
        misfit_m2 = self.tracker.misfit_m2
        errors = self._model_error.errors(points.stamp_ns, observed.names, misfit_m2)
        numbers = self._numbers(estimate, observed, errors)
        sources = self._sources(observed)
        return hand_pose(points, self._settings.method, numbers, self._radii(), sources)

    def _radii(self) -> list[float]:
        """Of the joints' skin, m, rounded."""
        factor = 1.0 if self._size is None else self._size.factor
        if factor != self._sized[0]:
            self._sized = factor, [rounded(factor * radius_m) for radius_m in self._radii_m]
        return self._sized[1]

    def _numbers(self, estimate: HandEstimate, observed: Observed, errors: ErrorsAt) -> Array:
        """All numbers of the pose (32, 8), its digits by the configured method."""
        settings, tracker = self._settings, self.tracker
        places = self._landmarks.packed(observed.names)
        if settings.method == DLS:
            options = settings.max_iterations, settings.tolerance_m
            seen = places, observed, tracker.whitening
            return dls_numbers(tracker.packed, *seen, estimate, errors, options)
        wrist = estimate.rotation, estimate.position_m
        points = places.parts.tip, observed.points_m, observed.covariances_m2, observed.measured
        tips = tips_in_wrist(wrist, points)
        fingers = solve_fingers(settings, tracker.chains, estimate.angles_rad, tips)
        given = errors.unpacked()
        spread = variances(tracker.chains, tracker.fitted, estimate, given)
        return pose_numbers(tracker.chains, wrist, fingers, spread, told_misfit(given))

    def _sources(self, observed: Observed) -> list[JointSource]:
        """Where each joint comes from; the same few sets of landmarks come again and again."""
        key = observed.names, observed.measured.tobytes()
        known = self._known_sources.get(key)
        if known is None:
            measured = set(compress(observed.names, observed.measured.tolist()))
            located = len(measured) >= MIN_LANDMARKS
            digits = {self._landmarks[name].digit for name in measured}
            known = joint_sources(measured, located, [row in digits for row in range(5)])
            if len(self._known_sources) < _MAX_SETS:
                self._known_sources[key] = known
        return known
