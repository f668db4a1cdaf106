"""A tracker with a dab of paint, moved and turned before cameras and a lighthouse: what both
report, with truth.

Geometry, timing and noise only, as testing/synthetic_points.py, whose rigs it uses. The hand that
moves it does so by waves of its own frequencies; the lighthouse's noise is white, or drifts with a
time constant. Some of its poses jump, some markers are of other things.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse, transform
from rhot.messages import Marker, MarkerFrame
from rhot.messages.objects import OpenVrPose
from testing.openvr_poses import openvr_pose
from testing.synthetic_points import SIZE_PX, START_NS, SyntheticRig

SERIAL, COLOR = "LHR-0A1B2C3D", "orange"
# Rounds of t = t_frame + y(t) * row_time.
_SHUTTER_ROUNDS = 5


@dataclass(frozen=True)
class TrackerMotion:
    """Waves about middle_m with a reach of size_m (both ways together), turning by turn_rad.

    axes and turns say along and about which axes it moves at all.
    """

    middle_m: tuple[float, float, float] = (0.0375, 0.0, 0.6)
    size_m: tuple[float, float, float] = (0.3, 0.25, 0.3)
    turn_rad: tuple[float, float, float] = (0.7, 0.7, 0.7)
    hz: tuple[float, float] = (0.15, 0.7)
    seed: int = 1
    _waves: list[Array] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        random = np.random.default_rng((self.seed, 7))
        # Amplitude, angular frequency and phase; (6 axes, 3 waves) each.
        share = random.uniform(0.5, 1.0, (6, 3))
        share /= share.sum(axis=1, keepdims=True)
        omega = 2.0 * np.pi * random.uniform(*self.hz, (6, 3))
        self._waves.extend([share, omega, random.uniform(0.0, 2.0 * np.pi, (6, 3))])

    def __call__(self, times_s: Array) -> tuple[Array, Array]:
        """Positions (n, 3) and rotations (n, 3, 3) of the tracker in the rig frame."""
        share, omega, phase = self._waves
        waves = np.sum(share * np.sin(omega * np.asarray(times_s)[:, None, None] + phase), axis=2)
        reach = np.concatenate([0.5 * np.array(self.size_m), self.turn_rad])
        moved = waves * reach * 1.4
        return np.array(self.middle_m) + moved[:, :3], Rotation.from_rotvec(
            moved[:, 3:]
        ).as_matrix()


@dataclass(frozen=True)
class Lighthouse:
    """What a lighthouse makes of a tracker's motion, and how wrong.

    noise_m and noise_rad are one standard deviation of each axis. correlation_s is the time
    constant of the noise (0: white). outliers is the share of poses that are off by up to
    outlier_m and 0.5 rad. late_s is by how much stamps are late.
    """

    noise_m: float = 1e-3
    noise_rad: float = np.deg2rad(0.2)
    correlation_s: float = 0.0
    outliers: float = 0.05
    outlier_m: float = 0.25
    late_s: float = 0.03
    rate_hz: float = 90.0
    seed: int = 1

    def T_rig_from_lighthouse(self) -> Array:  # noqa: N802 - frames cancel by name
        """Some place and direction of the lighthouses' frame; (4, 4)."""
        random = np.random.default_rng((self.seed, 11))
        return transform(Rotation.random(random_state=random).as_matrix(), random.normal(0, 1.5, 3))

    def poses(
        self, motion: TrackerMotion, seconds: float, serial: str = SERIAL
    ) -> list[OpenVrPose]:
        """What it reports over these seconds."""
        times_s = np.arange(-0.5, seconds + 0.5, 1.0 / self.rate_hz)
        positions, rotations = motion(times_s)
        T = inverse(self.T_rig_from_lighthouse())
        positions, rotations = positions @ T[:3, :3].T + T[:3, 3], T[:3, :3] @ rotations
        exact = zip(times_s.tolist(), rotations, positions, strict=True)
        return self.disturbed(
            [
                _pose(k, serial, START_NS + round(time_s * 1e9), np.column_stack([R, p]))
                for k, (time_s, R, p) in enumerate(exact)
            ]
        )

    def disturbed(self, poses: list[OpenVrPose]) -> list[OpenVrPose]:
        """Exact poses with this lighthouse's noise, outliers and lateness."""
        random = np.random.default_rng((self.seed, 13))
        matrices = np.array([pose.mDeviceToAbsoluteTracking for pose in poses])  # (n, 3, 4)
        shifts = self._noise(random, len(poses), self.noise_m)
        turns = self._noise(random, len(poses), self.noise_rad)
        wrong = random.random(len(poses)) < self.outliers
        count = int(wrong.sum())
        shifts[wrong] += random.uniform(-self.outlier_m, self.outlier_m, (count, 3))
        turns[wrong] += random.uniform(-0.5, 0.5, (count, 3))
        matrices[:, :, 3] += shifts
        matrices[:, :, :3] = matrices[:, :, :3] @ Rotation.from_rotvec(turns).as_matrix()
        late_ns = round(self.late_s * 1e9)
        return [
            msgspec.structs.replace(
                pose, stamp_ns=pose.stamp_ns + late_ns, mDeviceToAbsoluteTracking=_rows(matrix)
            )
            for pose, matrix in zip(poses, matrices, strict=True)
        ]

    def _noise(self, random: np.random.Generator, n: int, sigma: float) -> Array:
        white = random.normal(0.0, sigma, (n, 3))
        if self.correlation_s <= 0.0:
            return white
        keep = np.exp(-1.0 / (self.rate_hz * self.correlation_s))
        start = white[:1] * keep
        return lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white, axis=0, zi=start)[0]


def _rows(matrix: Array) -> Any:
    """A matrix (3, 4) as a message holds it, with the precision of SteamVR's."""
    return tuple(map(tuple, matrix.astype(np.float32).astype(np.float64).tolist()))


def _pose(seq: int, serial: str, stamp_ns: int, matrix: Array) -> OpenVrPose:
    return openvr_pose(_rows(matrix), serial, seq=seq, stamp_ns=stamp_ns, universe="1")


def painted_frames(
    setup: SyntheticRig,
    motion: TrackerMotion,
    marker_m: tuple[float, float, float],
    seconds: float,
    wrong: float = 0.01,
    color: str = COLOR,
) -> list[MarkerFrame]:
    """All cameras' frames of the paint at marker_m on the tracker; `wrong` is the share of markers
    that are something else, anywhere in the picture.
    """
    found: list[MarkerFrame] = []
    for number, camera in enumerate(setup.rig().values()):
        random = np.random.default_rng((setup.seed, number, 17))
        times_s = np.arange(0.0, seconds, 1.0 / setup.fps) + number * setup.phase_s
        pixels = _expose(camera, motion, np.array(marker_m), times_s, setup.row_time_ns * 1e-9)
        pixels = pixels + random.normal(0.0, setup.sigma_px, pixels.shape)
        other = random.random(len(times_s)) < wrong
        pixels[other] = random.uniform((0.0, 0.0), SIZE_PX, (int(other.sum()), 2))
        lost = random.random(len(times_s)) < setup.loss
        sign = -1.0 if number % 2 else 1.0
        for k in np.flatnonzero(~lost).tolist():
            skew_s = sign * (setup.skew_s + setup.drift_ppm * 1e-6 * times_s[k])
            found.append(
                MarkerFrame(
                    camera=camera.name,
                    seq=k,
                    stamp_ns=START_NS + round((times_s[k] + skew_s) * 1e9),
                    row_time_ns=setup.row_time_ns,
                    clock_offset_ns=round((skew_s + sign * setup.clock_error_s) * 1e9),
                    clock_sigma_ns=round(setup.clock_sigma_s * 1e9),
                    size_px=SIZE_PX,
                    markers=_marker(pixels[k], setup.sigma_px, color),
                )
            )
    return sorted(found, key=lambda frame: frame.stamp_ns - frame.clock_offset_ns)


def _expose(
    camera: Camera, motion: TrackerMotion, marker_m: Array, times_s: Array, row_time_s: float
) -> Array:
    """The paint's pixel (n, 2), seen at its own instant by a rolling shutter."""
    instants = times_s + 0.5 * SIZE_PX[1] * row_time_s
    pixels = np.zeros((len(times_s), 2))
    for _ in range(_SHUTTER_ROUNDS):
        position, rotation = motion(instants)
        pixels = camera.project(position + rotation @ marker_m)
        instants = times_s + pixels[:, 1] * row_time_s
    return pixels


def _marker(pixel: Array, sigma_px: float, color: str) -> list[Marker]:
    x, y = pixel.tolist()
    if not (0.0 <= x <= SIZE_PX[0] - 1 and 0.0 <= y <= SIZE_PX[1] - 1):
        return []
    return [
        Marker(
            color=color,
            x_px=round(x, 4),
            y_px=round(y, 4),
            area_px=80.0,
            sigma_px=sigma_px,
            quality=1.0,
        )
    ]
