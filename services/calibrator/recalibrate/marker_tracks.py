"""Markers that several cameras followed, brought to common instants: what the rig's refinement
works on. Pure.

Cameras run freely and read row by row, so every marker has its own instant. All tracks are
interpolated to the instants of the first camera's middle row, by the cubic through four samples.
Markers without a ray in the lens model, and instants inside a gap, count as not seen; cameras that
are not in the rig are passed over; a picture size other than the lens calibration's is a
CalibrationError.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.messages import MarkerFrame
from services.calibrator.bundle.lens_model import lens_vector, rays_from_pixels

# Samples further apart than this many usual steps enclose nobody knows what: a lost frame is 2.
_GAP_STEPS = 2.5
# Leaps are this many times the usual deviation from the neighbours, of which motion is a part; 5 px
# at the usual lens are none.
_LEAP, _LEAP_MIN = 8.0, 0.01
# Half the step of the numerical speed, s: short against a frame.
_STEP_S = 1e-3


def _cubic(times_s: Array, samples: Array, at_s: Array) -> Array:
    """Values (m, 2) at instants (m,) of the cubics through four samples (m, 4, 2) at times (m, 4)
    each (Lagrange).
    """
    weights = np.ones_like(times_s)
    for i in range(4):
        for j in range(4):
            if i != j:
                weights[:, i] *= (at_s - times_s[:, j]) / (times_s[:, i] - times_s[:, j])
    return np.einsum("mk,mki->mi", weights, samples)


@dataclass(frozen=True, eq=False)
class Track:
    """One marker in one camera: times (n,) s on the master's clock, ascending, and undistorted rays
    (n, 2).
    """

    times_s: Array
    rays: Array

    def at(self, times_s: Array) -> Array:
        """Rays (m, 2) at instants (m,); NaN where four samples do not enclose them."""
        n = len(self.times_s)
        found = np.full((len(times_s), 2), np.nan)
        if n < 4:
            return found
        place = np.searchsorted(self.times_s, times_s, side="right")
        inside = (place >= 2) & (place <= n - 2)
        around = np.clip(place, 2, n - 2)[:, None] + np.arange(-2, 2)  # (m, 4)
        t, seen = self.times_s[around], self.rays[around]
        steps = np.diff(t, axis=1)
        inside &= steps.max(axis=1) <= _GAP_STEPS * float(np.median(np.diff(self.times_s)))
        value = _cubic(t, seen, times_s)
        found[inside] = value[inside]
        return found


@dataclass(frozen=True, eq=False)
class Recording:
    """The colours (k), every camera's tracks by colour in the order of the rig, and the instants
    (m,) s that they are compared at.
    """

    colors: list[str]
    tracks: list[dict[str, Track]]
    instants_s: Array


@dataclass(frozen=True, eq=False)
class Looks:
    """What C cameras saw of k markers at m instants: rays and their derivatives by time (1/s), (C,
    m, k, 2), where seen (C, m, k).
    """

    seen: npt.NDArray[np.bool_]
    rays: Array
    speeds: Array


def recording(frames: Iterable[MarkerFrame], cameras: Mapping[str, Camera]) -> Recording:
    """The tracks of all markers.

    Raises CalibrationError for frames of another picture size than their camera's lens.
    """
    found: dict[str, dict[str, list[tuple[float, float, float]]]] = {
        name: defaultdict(list) for name in cameras
    }
    reference, instants_s = next(iter(cameras)), []
    begin_ns: int | None = None
    for frame in frames:
        camera = cameras.get(frame.camera)
        if camera is None:
            continue
        if tuple(frame.size_px) != tuple(camera.size_px):
            raise CalibrationError(
                f"camera {frame.camera!r}: the recording is {frame.size_px[0]}x{frame.size_px[1]}, its lens was calibrated at "
                f"{camera.size_px[0]}x{camera.size_px[1]}; record at that size, or run `rhot calibrate stereo` at this one"
            )
        begin_ns = frame.stamp_ns if begin_ns is None else begin_ns
        # Relative to the first frame: float64 cannot hold nanoseconds since 1970.
        start_s, row_s = (
            (frame.stamp_ns - frame.clock_offset_ns - begin_ns) * 1e-9,
            frame.row_time_ns * 1e-9,
        )
        if frame.camera == reference:
            instants_s.append(start_s + 0.5 * camera.size_px[1] * row_s)
        for marker in frame.markers:
            found[frame.camera][marker.color].append(
                (start_s + marker.y_px * row_s, marker.x_px, marker.y_px)
            )
    colors = sorted({color for tracks in found.values() for color in tracks})
    lenses = {
        name: lens_vector(camera.matrix, camera.distortion) for name, camera in cameras.items()
    }
    tracks = [
        {color: _track(lenses[name], rows) for color, rows in by_color.items()}
        for name, by_color in found.items()
    ]
    return Recording(colors, tracks, np.unique(instants_s))


def _track(lens: Array, rows: list[tuple[float, float, float]]) -> Track:
    table = np.array(rows)
    # Frames may come twice or out of order.
    _, first = np.unique(table[:, 0], return_index=True)
    table = table[first]
    seen = rays_from_pixels(lens, table[:, 1:])
    known = np.isfinite(seen).all(axis=1)
    return _without_leaps(Track(table[known, 0], seen[known]))


def _without_leaps(track: Track) -> Track:
    """The track without samples that lie far from where their four neighbours expect them, as wrong
    markers do.
    """
    n = len(track.times_s)
    if n < 5:
        return track
    middle = np.clip(np.arange(n), 2, n - 3)
    around = middle[:, None] + np.array([-2, -1, 1, 2])
    error = np.linalg.norm(
        _cubic(track.times_s[around], track.rays[around], track.times_s[middle])
        - track.rays[middle],
        axis=1,
    )
    keep = error <= max(_LEAP * float(np.median(error)), _LEAP_MIN)
    return Track(track.times_s[keep], track.rays[keep])


def looks(recorded: Recording, late_s: Array) -> Looks:
    """All cameras' views at the recording's instants.

    late_s (C,) is by how much each camera's stamps are late.
    """
    shape = (len(recorded.tracks), len(recorded.instants_s), len(recorded.colors))
    rays_at, speeds = np.full((*shape, 2), np.nan), np.full((*shape, 2), np.nan)
    for camera, tracks in enumerate(recorded.tracks):
        times_s = recorded.instants_s + late_s[camera]
        for number, color in enumerate(recorded.colors):
            if color in tracks:
                before, now, after = (
                    tracks[color].at(times_s + step_s) for step_s in (-_STEP_S, 0.0, _STEP_S)
                )
                rays_at[camera, :, number], speeds[camera, :, number] = (
                    now,
                    (after - before) / (2.0 * _STEP_S),
                )
    seen = np.isfinite(rays_at).all(axis=3) & np.isfinite(speeds).all(axis=3)
    return Looks(
        seen, np.where(seen[..., None], rays_at, 0.0), np.where(seen[..., None], speeds, 0.0)
    )
