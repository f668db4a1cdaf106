"""What ideal trackers would tell of points that move before the cameras: markers, no pictures.

Timing is that of a recording (camera_clock.py): rolling shutter, free-running cameras, residual
error of clocks, lost frames. Each marker is where its point is at its own row's instant, with white
noise; what lies outside the picture, or is unknown to the recording, is left out. Nothing is ever
hidden behind a hand that is not there. Pure.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from rhot.messages import HandPoint, HandPoints, Marker, MarkerFrame
from services.simulator.camera_clock import CameraClock
from services.simulator.recorded_motion.scenes import PointScene

# Noise of the tracker's centroids on rendered tips at 0.4 to 0.7 m (docs/notes/accuracy.md).
_SIGMA_PX = 0.06
# What a painted tip shows of itself: 14 mm of a finger 14 mm thick.
_PAINT_M2 = 1.9e-4
# Uncertainty of a capture's stamps, as `rhot track` takes it.
_CLOCK_SIGMA_NS = 500_000
# Rounds of t = t_frame + y(t) * row_time: each leaves a few hundredths of the row before.
_SHUTTER_ROUNDS = 4


def marker_frames(scene: PointScene, seconds: float, start_ns: int) -> list[MarkerFrame]:
    """All cameras' frames in the order of their stamps; the scene begins at start_ns."""
    found: list[MarkerFrame] = []
    for name, clock in scene.clocks.items():
        found += _camera_frames(scene, scene.cameras[name], clock, seconds, start_ns)
    return sorted(found, key=lambda frame: (frame.stamp_ns, frame.camera))


def _camera_frames(
    scene: PointScene, camera: Camera, clock: CameraClock, seconds: float, start_ns: int
) -> Iterator[MarkerFrame]:
    seqs = [k for k in range(clock.first_frame(seconds)) if not clock.dropped(k)]
    times_s = np.array([clock.time_s(seq) for seq in seqs])
    pixels, depth_m = _exposed(scene, camera, times_s, clock.row_time_ns * 1e-9)
    rng = np.random.default_rng([scene.seed, zlib.crc32(camera.name.encode()), 61])
    pixels = pixels + rng.normal(0.0, _SIGMA_PX, pixels.shape)
    area_px = camera.matrix[0, 0] * camera.matrix[1, 1] * _PAINT_M2 / depth_m**2
    for k, seq in enumerate(seqs):
        late_ns = clock.residual_at_ns(times_s[k]) + clock.stamp_error_ns(seq)
        yield MarkerFrame(
            camera=camera.name,
            seq=seq,
            stamp_ns=start_ns + round(times_s[k] * 1e9) + late_ns,
            row_time_ns=clock.row_time_ns,
            clock_offset_ns=0,
            clock_sigma_ns=_CLOCK_SIGMA_NS,
            size_px=camera.size_px,
            markers=_markers(scene.colors, pixels[k], area_px[k], camera.size_px),
        )


def _exposed(
    scene: PointScene, camera: Camera, times_s: Array, row_time_s: float
) -> tuple[Array, Array]:
    """Pixels (n, 6, 2) and depths (n, 6) m, each at its own instant; row 0 is exposed at times_s.

    NaN behind the camera too.
    """
    rows = np.full((len(times_s), len(BASIC_LANDMARKS)), 0.5 * camera.size_px[1])
    pixels, depth_m = np.empty((*rows.shape, 2)), np.empty(rows.shape)
    for _ in range(_SHUTTER_ROUNDS):
        points = scene.motion(times_s[:, None] + rows * row_time_s)
        local = points - camera.centre_rig
        depth_m = local @ camera.T_rig_from_camera[:3, 2]
        pixels = camera.project(points.reshape(-1, 3)).reshape(pixels.shape)
        pixels[~(depth_m > 0.0)] = np.nan
        # What is not seen has no row; far outside the picture the lens model ends.
        rows = np.clip(np.nan_to_num(pixels[..., 1]), 0.0, camera.size_px[1])
    return pixels, depth_m


def _markers(
    colors: tuple[str, ...], pixels: Array, area_px: Array, size_px: tuple[int, int]
) -> list[Marker]:
    """The markers of pixels (6, 2) inside the picture."""
    width, height = size_px
    return [
        Marker(
            color=color,
            x_px=round(float(x), 4),
            y_px=round(float(y), 4),
            area_px=round(float(area), 1),
            sigma_px=_SIGMA_PX,
            quality=1.0,
        )
        for color, (x, y), area in zip(colors, pixels, area_px, strict=True)
        if color and 0.0 <= x <= width - 1 and 0.0 <= y <= height - 1
    ]


def share_in_view(scene: PointScene, seconds: float) -> float:
    """Share of the landmarks that the recording knows and all cameras have in their pictures."""
    points = scene.motion(np.arange(0.0, seconds, 1.0 / 30.0)).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    seen = np.ones(len(points), dtype=bool)
    for camera in scene.cameras.values():
        depth_m = (points - camera.centre_rig) @ camera.T_rig_from_camera[:3, 2]
        last_px = np.array(camera.size_px) - 1
        pixels = camera.project(points)
        seen &= (depth_m > 0.0) & ((pixels >= 0.0) & (pixels <= last_px)).all(axis=1)
    return float(seen.mean())


def point_truth(scene: PointScene, seconds: float, start_ns: int) -> Iterator[HandPoints]:
    """The truth at each instant of the first camera: the landmarks that the recording knows."""
    clock = next(iter(scene.clocks.values()))
    times_s = np.array([clock.time_s(k) for k in range(clock.first_frame(seconds))])
    for seq, (t_s, points) in enumerate(zip(times_s, scene.motion(times_s), strict=True)):
        yield HandPoints(
            hand=scene.hand,
            seq=seq,
            stamp_ns=start_ns + round(t_s * 1e9),
            points=[
                HandPoint(
                    name=name,
                    position_m=tuple(np.round(place, 6).tolist()),
                    sigma_m=(0.0, 0.0, 0.0),
                    cameras=[],
                    source="measured",
                )
                for name, place in zip(BASIC_LANDMARKS, points, strict=True)
                if np.isfinite(place).all()
            ],
        )
