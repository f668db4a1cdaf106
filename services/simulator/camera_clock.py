"""When each simulated camera exposes its frames, and the errors of its computer's clock. Pure.

Cameras are not synchronised: each has a phase, a crystal and a clock of its own. Times are seconds
on the master's clock since the scene began; a stamp is nanoseconds. Everything follows from the
random seed, the camera's name and number, and the number of the frame.
"""

from __future__ import annotations

import hashlib
import zlib
from dataclasses import dataclass

import numpy as np

from rhot.files.rig_tables import CameraTable

# The time from the first row to the last: 30 us a row at 480 rows, between an imx219 and an ov5647
# (18.9 and 33.7 us).
_READOUT_S = 14.4e-3
# A sensor needs part of each period for blanking.
_MAX_READOUT = 0.85


@dataclass(frozen=True)
class CameraClock:
    """One camera's timing; `camera_clock` has the usual values."""

    period_s: float
    # Mid-exposure of row 0 of frame 0.
    phase_s: float
    row_time_ns: float
    exposure_s: float
    # The camera computer's clock reads offset + drift * t more than the master's.
    offset_ns: float
    drift_ppm: float
    # What is left of these two in a recording, after synchronisation of the clocks.
    residual_ns: float
    residual_ppm: float
    # Standard deviation of the stamps, and the share of frames that get lost.
    jitter_ns: float
    drop_rate: float
    seed: int

    def time_s(self, frame: int) -> float:
        """True instant of mid-exposure of row 0."""
        return self.phase_s + frame * self.period_s

    def first_frame(self, time_s: float) -> int:
        """The first frame whose row 0 is exposed at or after that instant."""
        return max(0, int(np.ceil((time_s - self.phase_s) / self.period_s - 1e-9)))

    def skew_ns(self, time_s: float) -> int:
        """What the camera computer's clock reads more than the master's."""
        return round(self.offset_ns + self.drift_ppm * 1e3 * time_s)

    def stamp_error_ns(self, frame: int) -> int:
        """Jitter of one frame's stamp, which the driver adds."""
        return round(float(self._rng(frame, 1).standard_normal()) * self.jitter_ns)

    def residual_at_ns(self, time_s: float) -> int:
        """Error of the clock that is left in a recording."""
        return round(self.residual_ns + self.residual_ppm * 1e3 * time_s)

    def dropped(self, frame: int) -> bool:
        """Whether this frame is lost on its way."""
        return bool(self._rng(frame, 2).random() < self.drop_rate)

    def _rng(self, frame: int, use: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, frame, use])


def camera_clock(
    table: CameraTable, number: int, cameras: int, exposure_s: float, seed: int
) -> CameraClock:
    """The clock of camera `number` of `cameras`, neither cameras nor computers synchronised.

    Phases are spread over the period (two cameras at 30 fps: 16.7 ms apart). Clocks are up to 20 ms
    off and drift up to 50 ppm, sensor crystals are within 20 ppm, 1.5 % of the frames are lost.
    """
    name, rows = table.name, table.size_px[1]
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), 3])
    period_s = (1.0 + rng.uniform(-20e-6, 20e-6)) / table.fps
    readout_s = min(_READOUT_S, _MAX_READOUT * period_s)
    return CameraClock(
        period_s=period_s,
        phase_s=(number / cameras + rng.uniform(0.0, 0.03)) * period_s + 0.02,
        row_time_ns=round(readout_s / rows * 1e9 * (1.0 + rng.uniform(-0.01, 0.01)), 1),
        exposure_s=min(exposure_s, 0.9 * period_s),
        offset_ns=float(rng.uniform(-20e6, 20e6)),
        drift_ppm=float(rng.uniform(-50.0, 50.0)),
        # Software clocks on a LAN agree to some 0.1 ms; 0.5 ms is the bound promised to readers of
        # captures.
        residual_ns=float(np.clip(rng.normal(0.0, 0.15e6), -0.4e6, 0.4e6)),
        residual_ppm=float(rng.uniform(-0.5, 0.5)),
        # FrameWallClock follows the kernel's time stamp of the frame interrupt.
        jitter_ns=20e3,
        drop_rate=0.015,
        seed=int.from_bytes(
            hashlib.blake2b(f"{seed}/{name}".encode(), digest_size=8).digest(), "little"
        ),
    )
