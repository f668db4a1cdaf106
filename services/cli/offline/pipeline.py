"""The rig's steps without its processes: frames to markers, markers to points and poses.

All markers of a recording come first (find_markers), then what follows from them (Pipeline). Frames
come in the order of time. The step objects are the services' own; their messages pass from one to
the next without a bus. Pure: the same frames give the same messages. With one camera, without a
hand or without geometry there are markers only (`Pipeline.hands` is then empty).
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import msgspec

from rhot.errors import CalibrationError
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandModel, HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.fusion.step import FusionStep
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep
from services.solver.step import SolverStep

# Heights of real pairs differ by a stereo RMS of .22 px as they were calibrated.
_LEVEL_PX = 0.5


@dataclass(frozen=True)
class Output:
    """What one frame led to."""

    markers: list[MarkerFrame] = field(default_factory=list)
    points: list[HandPoints] = field(default_factory=list)
    poses: list[HandPose] = field(default_factory=list)


class Pipeline:
    """Fusion and solver."""

    def __init__(
        self, config: RigConfig, cameras: dict[str, Camera] | None, *, align_clocks: bool = True
    ) -> None:
        """cameras as `geometry` returns them; align_clocks: whether clocks that contradict the
        markers are put right as frames come.
        """
        self._config, self._cameras, self._align_clocks = config, cameras, align_clocks
        self.hands: dict[HandName, HandModel] = {}
        self._fusion: FusionStep | None = None
        self._solver: SolverStep | None = None
        if cameras is not None:
            self.hands = {
                hand: load_hand(config.calibration_dir, hand, table.scale)
                for hand, table in config.hand.items()
            }
            self._fusion = FusionStep(config, cameras, self.hands)
            self._fusion.alignment.enabled &= align_clocks
            self._solver = SolverStep(config, self.hands)

    @property
    def refusals(self) -> dict[str, int]:
        """Frames and markers that fusion could not use, by reason."""
        counts = self._fusion.refusals if self._fusion is not None else {}
        return {reason: count for reason, count in sorted(counts.items()) if count}

    @property
    def sizes(self) -> dict[HandName, float]:
        """How large the hands that nobody measured are by their points, against an adult's."""
        if self._solver is None:
            return {}
        learned = {hand: self._solver.size(hand) for hand in self.hands}
        return {hand: size for hand, size in learned.items() if size is not None}

    @property
    def tilts(self) -> list[str]:
        """A sentence on each pair of cameras whose views are no longer level."""
        heights_px = self._fusion.clocks.heights_px if self._fusion is not None else {}
        return [
            f"the views of {first} and {second} differ by {abs(height_px):.1f} px in height: "
            "one of them has tilted since `rhot calibrate stereo`; up to 3 px are put right"
            for (first, second), height_px in heights_px.items()
            if abs(height_px) > _LEVEL_PX
        ]

    def again(self) -> Pipeline:
        """The same before its first frame, with what this one learned by the end.

        That is how large the hands are, and how cameras are tilted.
        """
        hands = {
            hand: msgspec.structs.replace(table, scale=self.sizes.get(hand, table.scale))
            for hand, table in self._config.hand.items()
        }
        config = msgspec.structs.replace(self._config, hand=hands)
        next_one = Pipeline(config, self._cameras, align_clocks=self._align_clocks)
        if self._fusion is not None and next_one._fusion is not None:
            next_one._fusion.levels.take(self._fusion.clocks.heights)
        return next_one

    def outputs(self, frames: Iterable[MarkerFrame]) -> Iterator[Output]:
        """What each frame leads to, and last what was still waiting for later ones."""
        for markers in frames:
            points = self._fusion.step(markers) if self._fusion is not None else []
            yield Output([markers], points, self._solve(points))
        points = self._fusion.flush() if self._fusion is not None else []
        yield Output([], points, self._solve(points))

    def _solve(self, points: list[HandPoints]) -> list[HandPose]:
        if self._solver is None or self._fusion is None:
            return []
        poses = [pose for one in points if (pose := self._solver.step(one)) is not None]
        for pose in poses:
            self._fusion.note_pose(pose)
        return poses


def find_markers(
    frame: Frame, tracker: TrackerStep, clock_sigma_ns: int, camera: Camera | None
) -> MarkerFrame:
    """The markers of one frame, whose clock is known that well.

    Raises CalibrationError if its size is not the one that the lens was calibrated at: no point
    could be computed from it.
    """
    if camera is not None and camera.size_px != frame.size_px:
        raise CalibrationError(
            f"camera {frame.camera!r}: its images are {frame.size_px[0]} x {frame.size_px[1]}, "
            f"its lens was calibrated at {camera.size_px[0]} x {camera.size_px[1]}; "
            f"use images of that size, or run `rhot calibrate lens {frame.camera}`"
        )
    return tracker.step(frame, clock_sigma_ns=clock_sigma_ns)


def geometry(config: RigConfig, names: list[str]) -> tuple[dict[str, Camera] | None, str]:
    """The calibrated cameras that 3D needs, or None and the reason why there will be markers only.

    Raises CalibrationError, naming the command that helps, if hands are configured, two cameras are
    there and one is uncalibrated.
    """
    if len(names) < 2:
        note = f"3D needs two cameras, this is {names[0]!r} alone; `rhot export` writes the markers"
        return None, f"markers only: {note}"
    if not config.hand:
        note = "rig.toml has no [hand.right.markers] table that says which colour is which landmark"
        return None, f"markers only: {note}"
    return load_rig_cameras(config, names), ""


def merged(streams: Iterable[Iterable[Frame]]) -> Iterator[Frame]:
    """All frames by stamp, then by name of the camera; each stream must be in order itself."""
    return heapq.merge(*streams, key=lambda frame: (frame.stamp_ns, frame.camera))
