"""A seeded hand of six points before a rig of free-running rolling-shutter cameras: MarkerFrames
and truth, without any picture.

What the benchmarks and tests of fusion measure with: geometry, timing and noise only, so that
errors are fusion's own. Pictures, paint and skin are the simulator's matter. Frames come in the
order of their exposure, each with its marker's own instant solved for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import msgspec
import numpy as np

from rhot.files.config import CameraTable, Fusion, HandTable, RigConfig
from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import Array, rotation_y, transform
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
class Setup:
    """The rig and its faults; the defaults are issue 4's moving hand before two cameras 16.7 ms
    apart.

    skew_s and drift_ppm are what a camera's clock reads more than the master's, clock_error_s what
    its announced offset is wrong by.
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

    def config(self, fusion: Fusion | None = None) -> RigConfig:
        """A rig.toml for it: one right hand with six colours."""
        markers = dict(zip(BASIC_LANDMARKS, COLORS, strict=True))
        cameras = [CameraTable(name=name, fps=self.fps) for name in self.names]
        return RigConfig(
            camera=cameras, hand={"right": HandTable(markers=markers)}, fusion=fusion or Fusion()
        )


def point_hands() -> dict[HandName, HandModel]:
    """A right hand whose paint has no extent: what fusion tells is then the point itself."""
    model = default_hand("right")
    paint = {
        name: msgspec.structs.replace(dab, radius_m=0.0, extent_m=0.0)
        for name, dab in model.paint.items()
    }
    return {"right": msgspec.structs.replace(model, paint=paint)}


@dataclass(frozen=True)
class Path:
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
        """Amplitudes (m), angular frequencies and phases (points, axes, waves) of that share of the
        mean squared speed.
        """
        omega = 2.0 * np.pi * random.uniform(*hz, shape)
        amplitude = random.uniform(0.4, 1.0, shape) / omega
        squared_speed = np.sum((amplitude * omega) ** 2 / 2.0, axis=(1, 2), keepdims=True)
        amplitude *= self.speed_m_s * np.sqrt(share / squared_speed)
        return amplitude, omega, random.uniform(0.0, 2.0 * np.pi, shape)

    def __call__(self, times_s: Array) -> Array:
        """Landmarks (n, 6, 3) in the rig frame at times (n,) or, one for each landmark, (n, 6)."""
        times = np.broadcast_to(
            np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1), (len(times_s), 6)
        )
        spread = np.array(
            [
                [0.0, 0.09, 0.0],
                [-0.07, 0.02, 0.0],
                [-0.03, -0.05, -0.01],
                [0.0, -0.07, -0.01],
                [0.03, -0.06, 0.0],
                [0.055, -0.03, 0.01],
            ]
        )
        points = np.array([0.0375, 0.0, self.distance_m]) + spread + np.zeros((len(times), 6, 3))
        for amplitude, omega, phase in self._terms:
            points = points + np.sum(
                amplitude * np.sin(omega * times[:, :, None, None] + phase), axis=-1
            )
        return points


@dataclass(frozen=True)
class Sway:
    """A hand at rest, which no hand is entirely: it sways as the simulator's do, three waves of 1.2
    mm and .4 deg at .1-.7 Hz an axis.

    Each landmark wanders in it by wander_m a wave and trembles at 8-12 Hz by a third of that. The
    landmark `plays` moves by itself, by stroke_m at 2 Hz. Until still_from_s the whole hand sweeps
    to and fro.
    """

    distance_m: float = 1.0
    plays: int | None = None
    stroke_m: float = 0.01
    still_from_s: float = 0.0
    wander_m: float = 1e-4
    seed: int = 1

    def __call__(self, times_s: Array) -> Array:
        """As Path."""
        random = np.random.default_rng(self.seed)
        omega, phase = (
            2.0 * np.pi * random.uniform(0.1, 0.7, (2, 3, 3)),
            random.uniform(0.0, 2.0 * np.pi, (2, 3, 3)),
        )
        times = np.broadcast_to(
            np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1), (len(times_s), 6)
        )
        waves = np.sum(
            np.sin(omega * times[:, :, None, None, None] + phase), axis=-1
        )  # (n, 6, shift and turn, axis)
        shape = Path(distance_m=self.distance_m, speed_m_s=0.0)(np.zeros(1))[0]
        points = (
            shape + 1.2e-3 * waves[:, :, 0] + np.cross(0.007 * waves[:, :, 1], shape - shape[0])
        )
        own = (
            2.0
            * np.pi
            * np.concatenate(
                [random.uniform(0.1, 0.7, (6, 3, 3)), random.uniform(8.0, 12.0, (6, 3, 1))], axis=2
            )
        )
        wanders = np.sin(
            own * times[:, :, None, None] + random.uniform(0.0, 2.0 * np.pi, (6, 3, 4))
        )  # (n, 6, axis, wave)
        points = points + self.wander_m * (wanders[..., :3].sum(axis=-1) + wanders[..., 3] / 3.0)
        if self.plays is not None:
            points[:, self.plays, 1] += self.stroke_m * np.sin(4.0 * np.pi * times[:, self.plays])
        # The sweep ends without a jerk.
        left = np.clip(self.still_from_s - times, 0.0, None) / 1.5
        points[:, :, 0] += 0.06 * np.sin(4.0 * left) * np.clip(left, 0.0, 1.0) ** 2
        return np.asarray(points)


def frames(setup: Setup, path: Motion, seconds: float) -> list[MarkerFrame]:
    """All cameras' frames in order of exposure."""
    found: list[tuple[float, MarkerFrame]] = []
    for n, camera in enumerate(setup.rig().values()):
        random = np.random.default_rng((setup.seed, n))
        times_s = np.arange(0.0, seconds, 1.0 / setup.fps) + n * setup.phase_s
        pixels = _expose(camera, path, times_s, setup.row_time_ns * 1e-9)
        pixels = pixels + random.normal(0.0, setup.sigma_px, pixels.shape)
        lost = random.random(len(times_s)) < setup.loss
        sign = -1.0 if n % 2 else 1.0
        for k in np.flatnonzero(~lost).tolist():
            skew_s = sign * (setup.skew_s + setup.drift_ppm * 1e-6 * times_s[k])
            found.append(
                (
                    times_s[k],
                    _frame(
                        setup, camera, k, times_s[k], skew_s, sign * setup.clock_error_s, pixels[k]
                    ),
                )
            )
    found.sort(key=lambda entry: entry[0])
    return [frame for _, frame in found]


def _expose(camera: Camera, path: Motion, times_s: Array, row_time_s: float) -> Array:
    """Each landmark's pixel (n, 6, 2), seen at its own instant by a rolling shutter whose first row
    is exposed at times_s (n,).
    """
    instants = np.repeat(times_s[:, None], 6, axis=1) + 0.5 * SIZE_PX[1] * row_time_s
    pixels = np.zeros((*instants.shape, 2))
    for _ in range(_SHUTTER_ROUNDS):
        pixels = camera.project(path(instants).reshape(-1, 3)).reshape(len(times_s), 6, 2)
        instants = times_s[:, None] + pixels[:, :, 1] * row_time_s
    return pixels


def _frame(
    setup: Setup,
    camera: Camera,
    seq: int,
    time_s: float,
    skew_s: float,
    error_s: float,
    pixels: Array,
) -> MarkerFrame:
    """One frame with the markers that lie in the picture."""
    markers = [
        Marker(
            color=color,
            x_px=round(x, 4),
            y_px=round(y, 4),
            area_px=80.0,
            sigma_px=setup.sigma_px,
            quality=1.0,
        )
        for color, (x, y) in zip(COLORS, pixels.tolist(), strict=True)
        if 0.0 <= x <= SIZE_PX[0] - 1 and 0.0 <= y <= SIZE_PX[1] - 1
    ]
    return MarkerFrame(
        camera=camera.name,
        seq=seq,
        stamp_ns=START_NS + round((time_s + skew_s) * 1e9),
        row_time_ns=setup.row_time_ns,
        clock_offset_ns=round((skew_s + error_s) * 1e9),
        clock_sigma_ns=round(setup.clock_sigma_s * 1e9),
        size_px=SIZE_PX,
        markers=markers,
    )
