"""Marker tracks of all cameras, sampled at common instants: what the rig's refinement works on.
Pure.

Cameras run freely and read row by row, so every marker has its own instant. All tracks are
interpolated to the instants of the first camera's middle row. Markers without a ray in the lens
model, and instants inside a gap, count as not seen; cameras that are not in the rig are passed
over; a picture size other than the lens calibration's is a CalibrationError.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.messages import MarkerFrame
from services.calibrator.bundle.lens_model import lens_vector, rays_from_pixels
from services.calibrator.bundle.picture_size import check_size
from services.calibrator.recalibrate.track import Track

# Half the step of the numerical derivative by time, s: short against a frame.
_HALF_STEP_S = 1e-3


@dataclass(frozen=True, eq=False)
class MarkerTracks:
    """Colours (k), the tracks of every camera by colour, and the instants (m,) s to compare at.

    Cameras are in the order of the rig.
    """

    colors: list[str]
    tracks: list[dict[str, Track]]
    instants_s: Array


@dataclass(frozen=True, eq=False)
class SampledRays:
    """What C cameras saw of k markers at m instants; zero where not seen."""

    seen: npt.NDArray[np.bool_]  # (C, m, k)
    rays: Array  # (C, m, k, 2)
    ray_rates: Array  # (C, m, k, 2), derivatives by time, 1/s


def build_tracks(frames: Iterable[MarkerFrame], cameras: Mapping[str, Camera]) -> MarkerTracks:
    """The tracks of all markers in the frames of these cameras.

    Raises CalibrationError for frames of another picture size than their camera's lens.
    """
    # Rows of (time s, x px, y px), by camera and colour.
    rows: dict[str, dict[str, list[tuple[float, float, float]]]] = {
        name: defaultdict(list) for name in cameras
    }
    reference = next(iter(cameras))
    instants_s: list[float] = []
    begin_ns: int | None = None
    for frame in frames:
        camera = cameras.get(frame.camera)
        if camera is None:
            continue
        check_size(frame, camera)
        begin_ns = frame.stamp_ns if begin_ns is None else begin_ns
        # Relative to the first frame: float64 cannot hold nanoseconds since 1970.
        start_s = (frame.stamp_ns - frame.clock_offset_ns - begin_ns) * 1e-9
        row_s = frame.row_time_ns * 1e-9
        if frame.camera == reference:
            instants_s.append(start_s + 0.5 * camera.size_px[1] * row_s)
        for marker in frame.markers:
            time_s = start_s + marker.y_px * row_s
            rows[frame.camera][marker.color].append((time_s, marker.x_px, marker.y_px))
    tracks = []
    for name, by_color in rows.items():
        lens = lens_vector(cameras[name].matrix, cameras[name].distortion)
        tracks.append({color: _track(lens, samples) for color, samples in by_color.items()})
    colors = sorted({color for by_color in rows.values() for color in by_color})
    return MarkerTracks(colors, tracks, np.unique(instants_s))


def _track(lens: Array, rows: list[tuple[float, float, float]]) -> Track:
    table = np.array(rows)
    # Frames may come twice or out of order.
    _, first = np.unique(table[:, 0], return_index=True)
    table = table[first]
    undistorted = rays_from_pixels(lens, table[:, 1:])
    known = np.isfinite(undistorted).all(axis=1)
    return Track(table[known, 0], undistorted[known]).without_outliers()


def sample_rays(recorded: MarkerTracks, stamp_delays_s: Array) -> SampledRays:
    """All cameras' rays at the recording's instants.

    stamp_delays_s (C,) is by how much each camera's stamps are late.
    """
    shape = (len(recorded.tracks), len(recorded.instants_s), len(recorded.colors), 2)
    sampled, rates = np.full(shape, np.nan), np.full(shape, np.nan)
    for c, tracks in enumerate(recorded.tracks):
        times_s = recorded.instants_s + stamp_delays_s[c]
        for k, color in enumerate(recorded.colors):
            if color not in tracks:
                continue
            before, now, after = (
                tracks[color].interpolate(times_s + step_s)
                for step_s in (-_HALF_STEP_S, 0.0, _HALF_STEP_S)
            )
            sampled[c, :, k] = now
            rates[c, :, k] = (after - before) / (2.0 * _HALF_STEP_S)
    seen = np.isfinite(sampled).all(axis=3) & np.isfinite(rates).all(axis=3)
    known = seen[..., None]
    return SampledRays(seen, np.where(known, sampled, 0.0), np.where(known, rates, 0.0))
