"""What a registration is made of: marker frames of all cameras, poses of all trackers. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame
from rhot.messages.objects import OpenVrPose
from services.calibrator.objects.guidance import motion_still_missing
from services.calibrator.objects.sightings import Sightings, sightings
from services.calibrator.objects.tracker_path import TrackerPath, tracker_path
from services.calibrator.objects.wanted import Painted

# OpenVR has 64 device slots; names come from the network.
_MAX_TRACKERS = 64
# Ten minutes of four cameras at 60 Hz, and of a tracker at 250 Hz.
_MAX_MESSAGES = 150_000


@dataclass
class Recorded:
    """Messages in the order of their arrival; those beyond ten minutes are left out."""

    frames: list[MarkerFrame] = field(default_factory=list)
    poses: dict[str, list[OpenVrPose]] = field(default_factory=dict)

    def add_frame(self, frame: MarkerFrame) -> None:
        """One camera's picture."""
        if len(self.frames) < _MAX_MESSAGES:
            self.frames.append(frame)

    def add_pose(self, pose: OpenVrPose) -> None:
        """One tracker's pose."""
        serial = pose.device.serial
        if serial not in self.poses and len(self.poses) >= _MAX_TRACKERS:
            return
        own = self.poses.setdefault(serial, [])
        if len(own) < _MAX_MESSAGES:
            own.append(pose)

    def sightings(
        self, cameras: Mapping[str, Camera], painted: list[Painted]
    ) -> dict[str, Sightings]:
        """What cameras saw of each tracker's paint, by serial."""
        return {one.serial: sightings(self.frames, cameras, one.color) for one in painted}

    def still_missing(self, one: Painted, cameras: Mapping[str, Camera]) -> list[str]:
        """What a registration still lacks, as a person can mend it; empty when there is enough."""
        seen = self.sightings(cameras, [one])[one.serial]
        return motion_still_missing(seen, tracker_path(self.poses.get(one.serial, [])))

    def paths(self) -> dict[str, TrackerPath]:
        """The path of every tracker, by serial."""
        return {serial: tracker_path(poses) for serial, poses in self.poses.items()}
