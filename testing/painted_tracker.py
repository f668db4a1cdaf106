"""A tracker with a dab of paint, moved before two cameras and lighthouses, as messages with truth.

What registration, drift watch and their command are tried with: geometry, timing and noise only.
Everything is random by a seed, and the same each time.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rhot import clock, topics
from rhot.bus.bus import Bus
from rhot.files.calibration import CameraPlace, Lens, RigGeometry, lens_kind, save
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_x,
    rotation_y,
    transform,
)
from rhot.messages import Marker, MarkerFrame
from rhot.messages.objects import OpenVrPose
from testing.openvr_poses import openvr_pose
from testing.synthetic_points import START_NS, SyntheticRig

T_RIG_FROM_LIGHTHOUSE = transform(rotation_x(np.pi) @ rotation_y(0.6), (0.6, 0.9, 1.4))
MARKER_M = (0.012, -0.021, 0.034)


@dataclass(frozen=True)
class PaintedTracker:
    """What moves, and how well it is seen.

    time_offset_s is how late the tracker's stamps are; the middle of the volume is at depth_m
    before the cameras, its half width size_m, and the tracker turns by up to turn_rad.
    """

    seconds: float = 20.0
    seed: int = 1
    sigma_px: float = 0.3
    tracker_m: float = 0.001
    tracker_rad: float = float(np.deg2rad(0.2))
    outliers: float = 0.05
    time_offset_s: float = 0.0
    fps: float = 30.0
    pose_hz: float = 90.0
    depth_m: float = 0.6
    size_m: float = 0.12
    turn_rad: float = 0.7
    area_px: float = 180.0
    color: str = "orange"
    serial: str = "LHR-1"
    universe: str = "one"
    marker_m: tuple[float, float, float] = MARKER_M
    T_rig_from_lighthouse: Array = field(default_factory=T_RIG_FROM_LIGHTHOUSE.copy)

    def cameras(self) -> dict[str, Camera]:
        """Two cameras 30 cm apart that look at the middle."""
        return SyntheticRig(baseline_m=0.3, toe_in_rad=0.2).rig()

    @cached_property
    def _waves(self) -> tuple[Array, Array]:
        """Rates and phases (6,) of the motion along and about the three axes."""
        rng = np.random.default_rng([self.seed, 5])
        return rng.uniform(0.15, 0.45, 6), rng.uniform(0.0, 2.0 * np.pi, 6)

    def truth(self, t_s: float) -> Array:
        """T_rig_from_tracker (4, 4)."""
        rates, phases = self._waves
        wave = np.sin(2.0 * np.pi * rates * t_s + phases)  # (6,)
        middle = np.array([0.15, 0.0, self.depth_m])
        R = rotation_from_vector(self.turn_rad * wave[3:] * (1.0, 1.0, 0.7))
        return transform(R, middle + self.size_m * wave[:3])

    def poses(self, start_s: float = 0.0, T_moved: Array | None = None) -> Iterator[OpenVrPose]:
        """What the lighthouses report; T_moved is what has been put before their frame since, so
        that T_rig_from_lighthouse is no longer true.
        """
        rng = np.random.default_rng([self.seed, 6, round(1e3 * start_s)])
        T_lighthouse_from_rig = inverse(self.T_rig_from_lighthouse)
        if T_moved is not None:
            T_lighthouse_from_rig = T_lighthouse_from_rig @ T_moved
        for number in range(round(self.seconds * self.pose_hz)):
            t_s = start_s + number / self.pose_hz
            T = T_lighthouse_from_rig @ self.truth(t_s)
            R = T[:3, :3] @ rotation_from_vector(self.tracker_rad * rng.standard_normal(3))
            far = 0.1 if rng.random() < self.outliers else 0.0
            p = T[:3, 3] + (self.tracker_m + far) * rng.standard_normal(3)
            matrix = np.column_stack([rotation_from_quaternion(quaternion_from_rotation(R)), p])
            yield openvr_pose(
                matrix,
                self.serial,
                seq=number,
                stamp_ns=START_NS + round(1e9 * (t_s + self.time_offset_s)),
                universe=self.universe,
                clock_sigma_ns=100_000,
            )

    def frames(self, start_s: float = 0.0) -> Iterator[MarkerFrame]:
        """What the cameras see, in the order of their stamps; the second one half a frame later."""
        rng = np.random.default_rng([self.seed, 7, round(1e3 * start_s)])
        cameras = self.cameras()
        for number in range(round(self.seconds * self.fps)):
            for index, camera in enumerate(cameras.values()):
                t_s = start_s + (number + 0.5 * index) / self.fps
                yield self._frame(camera, number, t_s, rng)

    def _frame(self, camera: Camera, seq: int, t_s: float, rng: np.random.Generator) -> MarkerFrame:
        row_time_ns = 20_000.0
        y_px = 0.5 * camera.size_px[1]
        for _ in range(3):
            T = self.truth(t_s + 1e-9 * row_time_ns * y_px)
            p_rig = apply(T, self.marker_m)
            x_px, y_px = camera.project(p_rig)[0].tolist()
        depth_m = float((p_rig - camera.centre_rig) @ camera.T_rig_from_camera[:3, 2])
        noise = (self.sigma_px * rng.standard_normal(2)).tolist()
        seen = Marker(
            color=self.color,
            x_px=x_px + noise[0],
            y_px=y_px + noise[1],
            area_px=self.area_px / depth_m**2 * (1.0 + 0.04 * float(rng.standard_normal())),
            sigma_px=max(self.sigma_px, 0.05),
            quality=0.9,
        )
        width, height = camera.size_px
        inside = 0.0 <= seen.x_px < width and 0.0 <= seen.y_px < height
        return MarkerFrame(
            camera=camera.name,
            seq=seq,
            stamp_ns=START_NS + round(1e9 * t_s),
            row_time_ns=row_time_ns,
            clock_offset_ns=0,
            clock_sigma_ns=100_000,
            size_px=camera.size_px,
            markers=[seen] if inside else [],
        )

    def at_rest(self) -> PaintedTracker:
        """The same, lying still."""
        return replace(self, size_m=0.0, turn_rad=0.0)


def write_cameras(scene: PaintedTracker, folder: Path) -> None:
    """rig.json and the lenses of the scene's cameras, as calibrated."""
    cameras = scene.cameras()
    places = {
        name: CameraPlace(T_rig_from_camera=rows_of(camera.T_rig_from_camera))
        for name, camera in cameras.items()
    }
    save(folder / "rig.json", RigGeometry(cameras=places))
    for name, camera in cameras.items():
        lens = Lens(
            size_px=camera.size_px,
            matrix=rows_of(camera.matrix),
            distortion=tuple(camera.distortion.tolist()),
            model=lens_kind(camera.distortion),
        )
        save(folder / f"{name}.lens.json", lens)


async def play(
    bus: Bus, scene: PaintedTracker, moved: Array | None = None, began_ns: int | None = None
) -> None:
    """Poses and pictures at their own pace, by this computer's clock; moved as in `poses`.

    The scene begins at began_ns: who compares with its truth must say when, as a busy machine may
    start this later.
    """
    poses = bus.publisher(topics.OPENVR, serial=scene.serial)
    frames = {name: bus.publisher(topics.MARKERS, camera=name) for name in scene.cameras()}
    began_ns = clock.now_ns() if began_ns is None else began_ns
    for second in range(int(scene.seconds)):
        one = replace(scene, seconds=1.0)
        due = [(pose.stamp_ns, 0, pose) for pose in one.poses(float(second), moved)]
        due += [(frame.stamp_ns + 40_000_000, 1, frame) for frame in one.frames(float(second))]
        due.sort(key=lambda message: message[:2])
        for at_ns, _, message in due:
            await asyncio.sleep(max(at_ns - START_NS + began_ns - clock.now_ns(), 0) * 1e-9)
            stamp_ns = message.stamp_ns - START_NS + began_ns
            shown = msgspec.structs.replace(message, stamp_ns=stamp_ns)
            if isinstance(shown, MarkerFrame):
                frames[shown.camera].put(shown)
            else:
                poses.put(shown)


def rows_of(matrix: Array) -> Any:
    """A matrix as messages and calibration files have it."""
    return tuple(map(tuple, matrix.tolist()))
