"""Fusion as one pure step: MarkerFrames in, HandPoints out. Live, offline, replayed and tested
alike.

One output per hand for each frame of the reference camera, the fastest one that delivers; if it
falls silent another carries on. Frames that come late, twice, out of order, from an unknown camera,
in another size than the calibration's, or with a clock that has jumped are counted in `refusals`
and otherwise have no effect; see timeline.py for when time is taken to have moved for all. Missing
cameras or markers make landmarks `predicted`, then absent; a hand of which nothing is seen gives
HandPoints without points.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping

import numpy as np

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HANDS, HandModel, HandName
from rhot.messages import HandPoint, HandPoints, HandPose, MarkerFrame, PointSource
from services.fusion.intake.admission import Timeline, Verdict
from services.fusion.intake.observations import Observer, Refusal
from services.fusion.kalman.estimator import KalmanMethod
from services.fusion.method import Estimates, Method
from services.fusion.monitors.clock_offsets import ClockTuner
from services.fusion.monitors.mirrored_view import MirrorWatch
from services.fusion.output.hand_plausibility import coherent, reach_m
from services.fusion.output.paint_to_bone import Surface
from services.fusion.output.schedule import Pace
from services.fusion.output.systematic_error import Bias
from services.fusion.paired.estimator import PairedMethod

# Positions and sigmas are told to a micrometre: a hundredth of the smallest sigma of a hand at
# arm's length.
_DIGITS = 6


class FusionStep:
    """The state of fusion between frames; deterministic in its input."""

    def __init__(
        self, config: RigConfig, cameras: Mapping[str, Camera], hands: Mapping[HandName, HandModel]
    ) -> None:
        """cameras by name as rhot.files.calibration.load_cameras gives them; a model for every
        [hand.*] table of the rig.

        Raises CalibrationError if there are fewer than two cameras or a hand's model is missing.
        """
        if len(cameras) < 2:
            raise CalibrationError(
                f"fusion needs two calibrated cameras or more, it has {sorted(cameras)}; add [[camera]] tables to rig.toml"
            )
        missing = [hand for hand in config.hand if hand not in hands]
        if missing:
            raise CalibrationError(
                f"no model of the {missing[0]} hand was given to fusion; it has {sorted(hands)}"
            )
        self.refusals: Counter[str] = Counter()
        self._observer = Observer(config, cameras)
        self._slots = self._observer.slots
        self._fps = np.array([config.camera_named(name).fps for name in cameras])
        self._surface = Surface(self._slots, hands, self._observer.cameras)
        self._bias = Bias(self._surface.extended, self._observer.cameras)
        self._hands = [hand for hand in HANDS if hand in config.hand]
        self._reach_m = {hand: reach_m(hands[hand]) for hand in self._hands}
        self._rows = {
            hand: np.array([row for row, slot in enumerate(self._slots) if slot.hand == hand])
            for hand in self._hands
        }
        all_cameras = self._observer.cameras
        periods_s = 1.0 / self._fps
        self.method: Method = (
            KalmanMethod(list(self._rows.values()), all_cameras, periods_s, config.fusion)
            if config.fusion.method == "kalman"
            else PairedMethod(len(self._slots), all_cameras, periods_s, config.fusion)
        )
        self.clocks = ClockTuner(
            all_cameras, len(self._slots), 1.0 / self._fps, enabled=config.fusion.tune_clocks
        )
        self.mirrors = MirrorWatch(all_cameras)
        self._wait = max(config.fusion.lag_frames, self.method.frames_after)
        self._timeline = Timeline(len(all_cameras))
        self._pace = Pace(self._fps, self._wait)
        self._epoch_ns = self._told_ns = 0
        self._seq = 0

    def step(self, frame: MarkerFrame) -> list[HandPoints]:
        """Take in one frame; the points that are due with it, one message per hand, or none."""
        view = self._observer.view(frame)
        if isinstance(view, Refusal):
            self.refusals[view.value] += 1
            return []
        self.refusals["marker"] += view.ignored
        verdict = self._timeline.judge(view.camera, view.instant_ns)
        if verdict in (Verdict.TWICE, Verdict.ASTRAY):
            self.refusals[verdict.value] += 1
            return []
        if verdict is Verdict.RESTART:
            self._restart(view.instant_ns)
        self.mirrors.observe(view)
        times_s = (view.instant_ns - self._epoch_ns) * 1e-9 + view.delay_s
        late_s, clock_sigma_s = self.clocks.observe(view, times_s)
        self.method.observe(
            dataclasses.replace(view, sigma=self._bias.note(view)), times_s - late_s, clock_sigma_s
        )
        due_ns = self._pace.frame(view.camera, view.instant_ns - round(late_s * 1e9))
        return [] if due_ns is None else self._tell(due_ns)

    def note_pose(self, pose: HandPose) -> None:
        """Learn from the solver which way the fingers point, which tells where in its paint a tip
        is; optional, and worth a millimetre.
        """
        if pose.hand in self._rows:
            self._surface.note(pose)

    def flush(self) -> list[HandPoints]:
        """The points still waiting for later frames, at the end of a recording."""
        return [points for instant_ns in self._pace.rest() for points in self._tell(instant_ns)]

    def _restart(self, instant_ns: int) -> None:
        """Forget everything.

        Seconds count from this instant, as float64 cannot hold nanoseconds since 1970.
        """
        self._epoch_ns = instant_ns
        self._pace = Pace(self._fps, self._wait)
        self.method.reset()
        self.clocks.reset()
        self._surface.forget()

    def _tell(self, instant_ns: int) -> list[HandPoints]:
        """One message per hand for an instant (master clock)."""
        estimates = self.method.estimate((instant_ns - self._epoch_ns) * 1e-9)
        positions, covariances = self._surface.to_axis(
            estimates.positions_m, estimates.covariances_m2, estimates.cameras, instant_ns
        )
        covariances = covariances + self._bias.covariances(positions, estimates.cameras)
        sigmas = np.sqrt(np.maximum(np.einsum("nii->ni", covariances), 0.0))
        usable = (
            estimates.found & np.isfinite(positions).all(axis=1) & np.isfinite(sigmas).all(axis=1)
        )
        self._seq += 1
        stamp_ns = min(max(instant_ns, 0), 2**63 - 1)
        told = []
        for hand, rows in self._rows.items():
            believed = coherent(
                positions[rows],
                covariances[rows],
                usable[rows],
                estimates.wanted[rows],
                self._reach_m[hand],
            )
            self.method.counts.incoherent += int(np.count_nonzero(usable[rows] & ~believed))
            points = [
                self._point(row, positions[row].tolist(), sigmas[row].tolist(), estimates)
                for row in rows[believed].tolist()
            ]
            told.append(HandPoints(hand=hand, seq=self._seq - 1, stamp_ns=stamp_ns, points=points))
        return told

    def _point(
        self, row: int, position: list[float], sigma: list[float], estimates: Estimates
    ) -> HandPoint:
        x, y, z = (round(value, _DIGITS) for value in position)
        sx, sy, sz = (max(round(value, _DIGITS), 10.0**-_DIGITS) for value in sigma)
        cameras = [
            camera.name
            for camera, seen in zip(
                self._observer.cameras, estimates.cameras[row].tolist(), strict=True
            )
            if seen
        ]
        source: PointSource = "measured" if estimates.measured[row] else "predicted"
        name = self._slots[row].landmark
        return HandPoint(
            name=name, position_m=(x, y, z), sigma_m=(sx, sy, sz), cameras=cameras, source=source
        )
