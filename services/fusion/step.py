"""Fusion as one pure step: MarkerFrames in, HandPoints out; the same live, offline and in tests.

One output per hand for each frame of the reference camera (output/schedule.py); if it falls silent
another carries on. Frames that come late, twice, out of order, from an unknown camera,
in another size than the calibration's, or with a clock that has jumped are counted in `refusals`
and otherwise have no effect; intake/admission.py says when time is taken to have moved for all.
Missing cameras or markers make landmarks `predicted`, then absent; a hand of which nothing is seen
gives HandPoints without points.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Fusion
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandModel, HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.fusion.alignment.clock_alignment import ClockAlignment, search_period_s
from services.fusion.alignment.level_views import LevelViews
from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.admission import FrameAdmission, Verdict
from services.fusion.intake.frame_pace import FramePace
from services.fusion.intake.observations import FrameRejection, Landmark, ObservationBuilder, View
from services.fusion.kalman.estimator import KalmanMethod
from services.fusion.method import Method
from services.fusion.monitors.clock_offsets import ClockOffsetEstimator
from services.fusion.monitors.markers_at_edge import EdgeMonitor
from services.fusion.monitors.mirrored_view import MirrorMonitor
from services.fusion.monitors.unseen_markers import UnseenMarkerMonitor
from services.fusion.output.hand_plausibility import hand_reach_m
from services.fusion.output.hand_points import Corrections, PointMessages
from services.fusion.output.pose_feedback import PoseFeedback
from services.fusion.output.schedule import OutputSchedule
from services.fusion.output.systematic_error import SystematicError
from services.fusion.paint.hidden_paint import HiddenPaint
from services.fusion.paint.paint_to_bone import Directions, PaintToBone
from services.fusion.paired.estimator import PairedMethod

# Reasons and cameras for which rejected frames are counted apart: a rig has four reasons for each
# of some cameras.
_MAX_REJECTED = 64
# Of frames of a loop that is behind, one of so many is learned from (docs/notes/scale.md; with six,
# poses came no sooner).
_LEARN_ONE_OF = 3


class FusionStep:
    """The state of fusion between frames; deterministic in its input."""

    def __init__(
        self, config: RigConfig, cameras: Mapping[str, Camera], hands: Mapping[HandName, HandModel]
    ) -> None:
        """cameras by name as rhot.files.calibration.load_cameras gives them.

        hands: a model for every [hand.*] table of the rig. Raises CalibrationError if there are
        fewer than two cameras or a hand's model is missing.
        """
        _check(config, cameras, hands)
        self.refusals: Counter[str] = Counter()
        # Of the same frames (reason, camera), and of those that had an effect; for the faults.
        self.rejected: Counter[tuple[str, str]] = Counter()
        self.admitted: Counter[str] = Counter()
        self._builder = ObservationBuilder(config, cameras)
        self._cameras = self._builder.cameras
        self._landmarks = self._builder.landmarks
        # Indices (n,) of each hand's landmarks.
        of_hand = np.array([landmark.hand for landmark in self._landmarks], dtype=str)
        self._rows = {
            hand: np.flatnonzero(of_hand == hand) for hand in HANDS if hand in config.hand
        }
        self._paint = PaintToBone(self._landmarks, hands, self._cameras)
        self._poses: PoseFeedback[Directions] = PoseFeedback()
        self._systematic = SystematicError(self._paint.extended, self._cameras)
        self._hidden = HiddenPaint(extrinsics(self._cameras), self._paint.round, self._paint.known)
        self.levels = LevelViews(self._cameras)
        self._messages = self._point_messages(hands)
        self._pace = FramePace(1.0 / np.array([config.camera_named(one).fps for one in cameras]))
        periods_s = self._pace.periods_s
        self.method = self._method(config.fusion, periods_s)
        self.clocks = ClockOffsetEstimator(
            self._cameras, len(self._landmarks), periods_s, enabled=config.fusion.tune_clocks
        )
        self.alignment = ClockAlignment(
            self._cameras,
            enabled=config.fusion.tune_clocks,
            every_s=search_period_s(config.rig.name),
        )
        self.mirrors = MirrorMonitor(self._cameras)
        self.unseen_markers = UnseenMarkerMonitor(self._cameras, self._landmarks)
        self.at_edge = EdgeMonitor([one.name for one in self._cameras], len(self._landmarks))
        self._lag_frames = max(config.fusion.lag_frames, self.method.frames_after)
        self._admission = FrameAdmission(len(self._cameras))
        self._schedule = OutputSchedule(self._pace.shortest_s, self._lag_frames)
        # Frames that nothing was learned from, as others waited; and how many of them in a row.
        self.unlearned, self._passed_over = 0, 0
        # What of the last frame is not done yet: settle().
        self._unsettled: list[Callable[[bool], None]] = []
        self._epoch_ns = 0
        self._seq = 0

    def _method(self, settings: Fusion, periods_s: Array) -> Method:
        """What rig.toml asks for; periods_s (C,): of FramePace."""
        hands = list(self._rows.values())
        if settings.method == "kalman":
            return KalmanMethod(hands, self._cameras, periods_s, settings)
        return PairedMethod(len(self._landmarks), self._cameras, periods_s, settings)

    def _point_messages(self, hands: Mapping[HandName, HandModel]) -> PointMessages:
        """Points as messages, corrected by what is known of paint and errors."""
        known = Corrections(
            self._paint.known,
            self._systematic.known,
            self._hidden.seen,
            extrinsics(self._cameras),
            self.levels.turns,
        )
        reach_m = {hand: hand_reach_m(hands[hand]) for hand in self._rows}
        return PointMessages(
            self._landmarks, reach_m, [camera.name for camera in self._cameras], known
        )

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """All landmarks of the rig's hands, in the order of their indices."""
        return self._landmarks

    @property
    def late_poses(self) -> int:
        """Poses that came too late for points which should rest on them."""
        return self._poses.late

    def step(self, frame: MarkerFrame) -> list[HandPoints]:
        """Take in one frame; the points that are due with it, one message per hand, or none."""
        self.settle()
        view = self._builder.build(frame)
        if isinstance(view, FrameRejection):
            return self._reject(view.value, frame.camera)
        self.refusals["marker"] += view.ignored
        stamp_ns = view.instant_ns + view.clock_offset_ns
        realigned = self.alignment.note_announced(view)
        self._unsettled.append(partial(self._align, view))
        view = self.alignment.aligned(view)
        verdict = self._admission.admit(view.camera, view.instant_ns, stamp_ns, frame.seq)
        astray = verdict is Verdict.ASTRAY
        if self.alignment.note_verdict(view.camera, astray=astray) or realigned:
            self._restart(self._admission.newest_ns or view.instant_ns)
        if verdict in (Verdict.TWICE, Verdict.ASTRAY):
            return self._reject(verdict.value, frame.camera)
        self.admitted[frame.camera] += 1
        if verdict is Verdict.RESTART:
            self._restart(view.instant_ns)
        self._pace.note(view.camera, view.instant_ns)
        times_s = (view.instant_ns - self._epoch_ns) * 1e-9 + view.delay_s  # (n,)
        late_s, clock_sigma_s = self.clocks.note_announced(view)
        self._unsettled.insert(0, partial(self._watch, view, times_s))
        view = self.levels.level(view)
        hidden = self._hidden.observe(view, (view.instant_ns - self._epoch_ns) * 1e-9)
        view = view._replace(sigmas=self._systematic.white_sigmas(view, hidden))
        self.method.observe(view, times_s - late_s, clock_sigma_s)
        due_ns = self._schedule.add_frame(view.camera, view.instant_ns - round(late_s * 1e9))
        return [points for instant_ns in due_ns for points in self._points_at(instant_ns)]

    def settle(self, *, behind: bool = False) -> None:
        """Do what a frame's points do not wait for: watch it, and learn the clocks from it.

        After the points are out; the next step() does it where nobody has. Counts from the next
        frame on. behind: other frames wait, which is worth more than to learn from all of them.
        """
        unsettled, self._unsettled = self._unsettled, []
        if unsettled:
            self._passed_over = self._passed_over + 1 if behind else 0
            if self._passed_over % _LEARN_ONE_OF:
                self.unlearned += 1
            else:
                for work in unsettled:
                    work(behind)
        self.method.settle()

    def _watch(self, view: View, times_s: Array, _behind: bool) -> None:
        """Learn from an admitted frame, whose observations have times_s (n,)."""
        self.mirrors.observe(view)
        self.unseen_markers.observe(view)
        self.at_edge.observe(view)
        self.clocks.observe(view, times_s)
        self.levels.take(self.clocks.heights)

    def _align(self, view: View, behind: bool) -> None:
        """Look in a frame, as announced, for clocks that are off by more."""
        if self.alignment.observe(view, behind=behind, doubted=self.clocks.doubted):
            self._restart(self._admission.newest_ns or view.instant_ns)

    def note_pose(self, pose: HandPose) -> None:
        """Learn from the solver which way the fingers point: where in its paint a tip is.

        Optional, and worth a millimetre. It counts from a fixed time after its own instant on
        (output/pose_feedback.py), whenever it comes.
        """
        if pose.hand in self._rows:
            self._poses.add(self._paint.directions(pose))

    def flush(self) -> list[HandPoints]:
        """The points still waiting for later frames, at the end of a recording."""
        self.settle()
        waiting_ns = self._schedule.take_waiting()
        waiting = [points for instant_ns in waiting_ns for points in self._points_at(instant_ns)]
        self.settle()
        return waiting

    def _reject(self, reason: str, camera: str) -> list[HandPoints]:
        """Count a frame that has no other effect."""
        self.refusals[reason] += 1
        # Strangers' names come from the network; they must not fill the memory.
        if (reason, camera) in self.rejected or len(self.rejected) < _MAX_REJECTED:
            self.rejected[reason, camera] += 1
        return []

    def _restart(self, instant_ns: int) -> None:
        """Forget everything.

        Seconds count from this instant, as float64 cannot hold nanoseconds since 1970.
        """
        self._epoch_ns = instant_ns
        self._schedule = OutputSchedule(self._pace.shortest_s, self._lag_frames)
        self._pace.forget()
        self.method.reset()
        self.clocks.reset()
        self._paint.reset()
        self._poses.reset()
        self._hidden.reset()

    def _points_at(self, instant_ns: int) -> list[HandPoints]:
        """One message per hand for an instant (master clock)."""
        for told in self._poses.take(instant_ns):
            self._paint.note(told)
        estimates = self.method.estimate((instant_ns - self._epoch_ns) * 1e-9)
        points_of, incoherent = self._messages.of(estimates, instant_ns)
        self.method.counts.incoherent += incoherent
        stamp_ns = min(max(instant_ns, 0), 2**63 - 1)
        messages = [
            HandPoints(hand=hand, seq=self._seq, stamp_ns=stamp_ns, points=points)
            for hand, points in points_of.items()
        ]
        self._seq += 1
        return messages


def _check(
    config: RigConfig, cameras: Mapping[str, Camera], hands: Mapping[HandName, HandModel]
) -> None:
    """Raise CalibrationError if there are fewer than two cameras or a hand's model is missing."""
    if len(cameras) < 2:
        raise CalibrationError(
            f"fusion needs two calibrated cameras or more, it has {sorted(cameras)}; "
            f"add [[camera]] tables to rig.toml"
        )
    missing = [hand for hand in config.hand if hand not in hands]
    if missing:
        raise CalibrationError(
            f"no model of the {missing[0]} hand was given to fusion; it has {sorted(hands)}"
        )
