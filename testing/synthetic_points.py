"""Synthetic MarkerFrames with truth: a hand of six points before a rig of rolling-shutter cameras.

What the benchmarks and tests of fusion measure with: geometry, timing and noise only, without any
picture, so that errors are fusion's own. (Pictures, paint and skin are the simulator's matter.) The
cameras run freely, with clocks of their own. Frames come in the order of their exposure, each with
its marker's own instant solved for. Everything is random by a seed, and the same each time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rhot.files.calibration import CameraPlace, Lens, RigGeometry, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, Fusion, HandTable
from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import Array, rotation_x, rotation_y, transform
from rhot.hand import BASIC_LANDMARKS, HandModel, HandName, default_hand
from rhot.messages import Marker, MarkerFrame

COLORS = ("violet", "magenta", "blue", "cyan", "green", "lime")
SIZE_PX = (640, 480)
# Master clock at the start: some day in 2024, as a stamp near zero would hide mistakes of
# precision.
START_NS = 1_720_000_000_000_000_000
# Rounds of t = t_frame + y(t) * row_time: motion over a frame's readout changes y by a few rows,
# then by a few hundredths.
_SHUTTER_ROUNDS = 4
# Landmarks (n, 6, 3) in the rig frame at times (n,) or, one for each landmark, (n, 6).
Motion = Callable[[Array], Array]


@dataclass(frozen=True)
class SyntheticRig:
    """The rig and its faults; the defaults are two cameras 16.7 ms apart.

    skew_s and drift_ppm are what a camera's clock reads more than the master's, clock_error_s what
    its announced offset is wrong by, clock_sigma_s how far that may be off by its own account. loss
    is the share of frames that are lost. Every other camera nods by tilt_rad more than its
    calibration says.
    """

    cameras: int = 2
    baseline_m: float = 0.075
    # Each camera is turned towards the middle by so much; distortion is k1, k2, p1, p2, k3 of all.
    toe_in_rad: float = 0.0
    distortion: tuple[float, float, float, float, float] = (-0.05, 0.01, 0.0005, -0.0005, 0.0)
    fps: float = 30.0
    phase_s: float = 1.0 / 60.0
    row_time_ns: float = 33_700.0
    sigma_px: float = 0.06
    skew_s: float = 0.02
    drift_ppm: float = 50.0
    clock_error_s: float = 0.0005
    clock_sigma_s: float = 0.0005
    loss: float = 0.02
    tilt_rad: float = 0.0
    seed: int = 1

    @property
    def names(self) -> tuple[str, ...]:
        """left, right, and further ones by number."""
        return ("left", "right", *(f"camera{n}" for n in range(3, self.cameras + 1)))[
            : self.cameras
        ]

    def rig(self) -> dict[str, Camera]:
        """The calibrated cameras: the first is the rig frame, the others stand along its +x."""
        found = {}
        for n, name in enumerate(self.names):
            turn = self.toe_in_rad * (1.0 - 2.0 * n / max(self.cameras - 1, 1))
            T = transform(rotation_y(turn), (n * self.baseline_m, 0.0, 0.0))
            found[name] = Camera(
                name, SIZE_PX, pinhole(SIZE_PX, np.deg2rad(62.5)), np.array(self.distortion), T
            )
        return found

    def tilted_rig(self) -> dict[str, Camera]:
        """The cameras as they are: tilted since they were calibrated."""
        found, nod = self.rig(), transform(rotation_x(self.tilt_rad), (0.0, 0.0, 0.0))
        for name in self.names[1::2]:
            tilted = found[name].T_rig_from_camera @ nod
            found[name] = replace(found[name], T_rig_from_camera=tilted)
        return found

    def save_calibration(self, folder: Path) -> None:
        """Write <camera>.lens.json of every camera, and rig.json."""
        places = {}
        for name, camera in self.rig().items():
            lens = Lens(
                size_px=camera.size_px, matrix=_rows(camera.matrix), distortion=self.distortion
            )
            save(folder / f"{name}.lens.json", lens)
            places[name] = CameraPlace(T_rig_from_camera=_rows(camera.T_rig_from_camera))
        save(folder / "rig.json", RigGeometry(cameras=places))

    def config(self, fusion: Fusion | None = None) -> RigConfig:
        """A rig.toml for it: one right hand with six colours."""
        markers = dict(zip(BASIC_LANDMARKS, COLORS, strict=True))
        cameras = [CameraTable(name=name, fps=self.fps) for name in self.names]
        return RigConfig(
            camera=cameras, hand={"right": HandTable(markers=markers)}, fusion=fusion or Fusion()
        )


def _rows(matrix: Array) -> Any:
    """A matrix as calibration files hold it."""
    return tuple(map(tuple, matrix.tolist()))


def point_hands() -> dict[HandName, HandModel]:
    """A right hand whose paint has no extent: what fusion gives is then the point itself."""
    model = default_hand("right")
    paint = {
        name: msgspec.structs.replace(dab, radius_m=0.0, extent_m=0.0)
        for name, dab in model.paint.items()
    }
    return {"right": msgspec.structs.replace(model, paint=paint)}


# The landmarks of an open hand about its middle (6, 3), facing the cameras.
_OPEN_HAND_M = np.array(
    [
        [0.0, 0.09, 0.0],
        [-0.07, 0.02, 0.0],
        [-0.03, -0.05, -0.01],
        [0.0, -0.07, -0.01],
        [0.03, -0.06, 0.0],
        [0.055, -0.03, 0.01],
    ]
)


def _per_landmark(times_s: Array) -> Array:
    """Times (n, 6) from times (n,) or (n, 6)."""
    times = np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1)
    return np.broadcast_to(times, (len(times_s), 6))


@dataclass(frozen=True)
class MovingHand:
    """A hand that moves as a sum of sinusoids, and its fingers as another.

    speed_m_s is the RMS speed of a landmark in space.
    """

    distance_m: float = 0.7
    speed_m_s: float = 0.5
    # Hand 0.6-1.5 Hz: below, half a metre a second would leave the picture; fingers tap at up to
    # 2.5 Hz.
    hand_hz: tuple[float, float] = (0.6, 1.5)
    finger_hz: tuple[float, float] = (1.0, 2.5)
    # Share of the speed's square that is the fingers' own.
    finger_share: float = 0.2
    seed: int = 1
    _terms: list[tuple[Array, Array, Array]] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        random = np.random.default_rng(self.seed)
        self._terms.append(self._waves(random, (1, 3, 3), self.hand_hz, 1.0 - self.finger_share))
        self._terms.append(self._waves(random, (6, 3, 2), self.finger_hz, self.finger_share))

    def _waves(
        self,
        random: np.random.Generator,
        shape: tuple[int, int, int],
        hz: tuple[float, float],
        share: float,
    ) -> tuple[Array, Array, Array]:
        """Amplitudes (m), angular frequencies and phases, (points, axes, waves) each.

        share: of the mean squared speed that they make up.
        """
        omega = 2.0 * np.pi * random.uniform(*hz, shape)
        amplitude = random.uniform(0.4, 1.0, shape) / omega
        squared_speed = np.sum((amplitude * omega) ** 2 / 2.0, axis=(1, 2), keepdims=True)
        amplitude *= self.speed_m_s * np.sqrt(share / squared_speed)
        return amplitude, omega, random.uniform(0.0, 2.0 * np.pi, shape)

    def __call__(self, times_s: Array) -> Array:
        """Landmarks (n, 6, 3) in the rig frame at times (n,) or, one for each landmark, (n, 6)."""
        times = _per_landmark(times_s)  # (n, 6)
        points = (
            np.array([0.0375, 0.0, self.distance_m]) + _OPEN_HAND_M + np.zeros((len(times), 6, 3))
        )
        for amplitude, omega, phase in self._terms:
            points = points + np.sum(
                amplitude * np.sin(omega * times[:, :, None, None] + phase), axis=-1
            )
        return points


@dataclass(frozen=True)
class RestingHand:
    """A hand at rest, which no hand is entirely: it sways as the simulator's do.

    The sway is three waves of 1.2 mm and .4 deg at .1-.7 Hz an axis. Each landmark wanders in it by
    wander_m a wave and trembles at 8-12 Hz by a third of that. The landmark `plays` moves by
    itself, by stroke_m at 2 Hz. Until still_from_s the whole hand sweeps to and fro.
    """

    distance_m: float = 1.0
    plays: int | None = None
    stroke_m: float = 0.01
    still_from_s: float = 0.0
    wander_m: float = 1e-4
    seed: int = 1

    def __call__(self, times_s: Array) -> Array:
        """As MovingHand."""
        random = np.random.default_rng(self.seed)
        times = _per_landmark(times_s)  # (n, 6)
        omega = 2.0 * np.pi * random.uniform(0.1, 0.7, (2, 3, 3))
        phase = random.uniform(0.0, 2.0 * np.pi, (2, 3, 3))
        waves = np.sin(omega * times[:, :, None, None, None] + phase)
        sway = np.sum(waves, axis=-1)  # (n, 6, translation and rotation, axis)
        shape = MovingHand(distance_m=self.distance_m, speed_m_s=0.0)(np.zeros(1))[0]  # (6, 3)
        translation = 1.2e-3 * sway[:, :, 0]
        points = shape + translation + np.cross(0.007 * sway[:, :, 1], shape - shape[0])
        points = points + self._wander(random, times)
        if self.plays is not None:
            points[:, self.plays, 1] += self.stroke_m * np.sin(4.0 * np.pi * times[:, self.plays])
        # The sweep ends without a jerk.
        left = np.clip(self.still_from_s - times, 0.0, None) / 1.5
        points[:, :, 0] += 0.06 * np.sin(4.0 * left) * np.clip(left, 0.0, 1.0) ** 2
        return np.asarray(points)

    def _wander(self, random: np.random.Generator, times: Array) -> Array:
        """What each landmark moves by itself (n, 6, 3) at times (n, 6): slow and fast."""
        slow_hz = random.uniform(0.1, 0.7, (6, 3, 3))
        fast_hz = random.uniform(8.0, 12.0, (6, 3, 1))
        omega = 2.0 * np.pi * np.concatenate([slow_hz, fast_hz], axis=2)  # (6, axis, wave)
        phase = random.uniform(0.0, 2.0 * np.pi, (6, 3, 4))
        waves = np.sin(omega * times[:, :, None, None] + phase)  # (n, 6, axis, wave)
        return self.wander_m * (waves[..., :3].sum(axis=-1) + waves[..., 3] / 3.0)


def frames(setup: SyntheticRig, motion: Motion, seconds: float) -> list[MarkerFrame]:
    """All cameras' frames in order of exposure."""
    found: list[tuple[float, MarkerFrame]] = []
    for n, camera in enumerate(setup.tilted_rig().values()):
        random = np.random.default_rng((setup.seed, n))
        times_s = np.arange(0.0, seconds, 1.0 / setup.fps) + n * setup.phase_s
        pixels = _expose(camera, motion, times_s, setup.row_time_ns * 1e-9)
        pixels = pixels + random.normal(0.0, setup.sigma_px, pixels.shape)
        lost = random.random(len(times_s)) < setup.loss
        # Every other camera's clock is off the other way.
        sign = -1.0 if n % 2 else 1.0
        for k in np.flatnonzero(~lost).tolist():
            skew_s = sign * (setup.skew_s + setup.drift_ppm * 1e-6 * times_s[k])
            frame = MarkerFrame(
                camera=camera.name,
                seq=k,
                stamp_ns=START_NS + round((times_s[k] + skew_s) * 1e9),
                row_time_ns=setup.row_time_ns,
                clock_offset_ns=round((skew_s + sign * setup.clock_error_s) * 1e9),
                clock_sigma_ns=round(setup.clock_sigma_s * 1e9),
                size_px=SIZE_PX,
                markers=_markers(pixels[k], setup.sigma_px),
            )
            found.append((times_s[k], frame))
    found.sort(key=lambda entry: entry[0])
    return [frame for _, frame in found]


def _expose(camera: Camera, motion: Motion, times_s: Array, row_time_s: float) -> Array:
    """Each landmark's pixel (n, 6, 2), seen at its own instant by a rolling shutter.

    The shutter's first row is exposed at times_s (n,).
    """
    instants = np.repeat(times_s[:, None], 6, axis=1) + 0.5 * SIZE_PX[1] * row_time_s
    pixels = np.zeros((*instants.shape, 2))
    for _ in range(_SHUTTER_ROUNDS):
        pixels = camera.project(motion(instants).reshape(-1, 3)).reshape(len(times_s), 6, 2)
        instants = times_s[:, None] + pixels[:, :, 1] * row_time_s
    return pixels


def _markers(pixels: Array, sigma_px: float) -> list[Marker]:
    """The markers of the landmarks' pixels (6, 2) that lie in the image."""
    width, height = SIZE_PX
    return [
        Marker(
            color=color,
            x_px=round(x, 4),
            y_px=round(y, 4),
            area_px=80.0,
            sigma_px=sigma_px,
            quality=1.0,
        )
        for color, (x, y) in zip(COLORS, pixels.tolist(), strict=True)
        if 0.0 <= x <= width - 1 and 0.0 <= y <= height - 1
    ]
