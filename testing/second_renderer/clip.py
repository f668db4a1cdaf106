"""What a clip is: a recorded hand, how it is built, painted and lit, who films it. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable
from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import rotation_from_vector, transform
from testing.second_renderer.motion import Play
from testing.second_renderer.paint import COLORS, LANDMARKS, Job, Painted, painted
from testing.second_renderer.pictures import Shutter
from testing.second_renderer.room import Light
from testing.second_renderer.sensor import Sensor
from testing.second_renderer.skin import Build, Skinned, hand_mesh

SIZE_PX = (640, 480)


@dataclass(frozen=True)
class Rig:
    """Two free-running cameras, the right one a little turned, rolled and out of line.

    skew_s: what the right camera's clock reads more; clock_error_s: how wrong its announcement is.
    """

    baseline_m: float = 0.08
    toe_in_deg: float = 2.0
    tilt_deg: float = 0.7
    fov_deg: float = 62.0
    k1: float = -0.06
    fps: float = 30.0
    phase_s: float = 0.0121
    skew_s: float = 0.02
    clock_error_s: float = 0.0003

    def cameras(self) -> dict[str, Camera]:
        """By name; the left one is the rig's frame."""
        found = {}
        for n, name in enumerate(("left", "right")):
            turn = np.deg2rad([n * self.tilt_deg, -n * 2.0 * self.toe_in_deg, 0.4 * n])
            place = (n * self.baseline_m, 0.001 * n, 0.002 * n)
            matrix = pinhole(SIZE_PX, np.deg2rad(self.fov_deg + 0.6 * n))
            matrix = matrix + np.array([[0, 0, 3.0 - 5.0 * n], [0, 0, 2.0 * n], [0, 0, 0]])
            distortion = np.array([self.k1, 0.012, 4e-4, -3e-4, 0.0])
            T = transform(rotation_from_vector(turn), place)
            found[name] = Camera(name, SIZE_PX, matrix, distortion, T)
        return found


@dataclass(frozen=True)
class Clip:
    """All that makes a clip; its repr says everything.

    given_scale is the size that fusion and solver guess.
    """

    play: Play
    build: Build = field(default_factory=Build)
    job: Job = field(default_factory=Job)
    light: Light = field(default_factory=Light)
    shutter: Shutter = field(default_factory=Shutter)
    sensor: Sensor = field(default_factory=Sensor)
    rig: Rig = field(default_factory=Rig)
    given_scale: float = 1.0
    seconds: float = 8.0
    seed: int = 1

    def hand(self) -> tuple[Skinned, Painted]:
        """The hand's skin, and its paint."""
        bones = self.play.bones(np.linspace(0.0, self.seconds, 60))
        mesh = hand_mesh(bones, self.build)
        return Skinned(mesh), painted(mesh, self.job)

    def config(self) -> RigConfig:
        """A rig.toml for it."""
        markers = dict(zip(LANDMARKS, COLORS, strict=True))
        cameras = [CameraTable(name=name, fps=self.rig.fps) for name in ("left", "right")]
        hand = HandTable(markers=markers, scale=self.given_scale)
        return RigConfig(camera=cameras, hand={"right": hand})
