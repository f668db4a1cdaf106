"""Compiles (or loads from numba's cache) everything fusion calls, before the first frame is there.

With a cache (rhot.kernels.numba_cache) this takes a second or two, without one minutes; a service
that did it at its first frame would stand still for that long.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HandModel, HandName
from rhot.messages import Marker, MarkerFrame
from services.fusion.alignment.height_memory import heights_by_landmark
from services.fusion.alignment.height_track import HeightTrack, interpolated
from services.fusion.alignment.level_views import turned_rays
from services.fusion.monitors.shift_regression import Heights, fit_shift
from services.fusion.paint.paint_to_bone import Directions, PaintToBone, turn_with_joints
from services.fusion.step import FusionStep

# Enough frames of each camera for a track to start, to be filtered anew, smoothed, and for an
# update of the clock offsets.
_FRAMES = 8
# From this one on one camera alone sees one of the markers.
_ALONE_FROM = 4


def warm_up(
    config: RigConfig, cameras: Mapping[str, Camera], hands: Mapping[HandName, HandModel]
) -> int:
    """Run a scratch FusionStep over a still point half a metre before the cameras.

    Returns how many messages it made.
    """
    step = FusionStep(config, cameras, hands)
    first = next(iter(cameras.values()))
    point = (first.T_rig_from_camera @ [0.0, 0.0, 0.5, 1.0])[:3]
    messages = 0
    for seq in range(_FRAMES):
        for n, camera in enumerate(cameras.values()):
            stamp_ns = 10**18 + round((seq + 0.3 * n) * 1e9 / 30.0)
            colors = config.colors[1:] if n and seq >= _ALONE_FROM else config.colors
            messages += len(step.step(_frame(camera, seq, stamp_ns, point, colors)))
    # What only a pose that comes back, some seconds of heights, or a tilted camera would call.
    hand, nobody = next(iter(hands)), np.empty(0, dtype=np.int64)
    none, aims = np.empty((0, 3)), (np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 2)))
    turn_with_joints(np.empty(0), 0.0, nobody, none, *aims)
    paint = PaintToBone(step.landmarks, hands, tuple(cameras.values()))
    paint.note(Directions(hand, 0, nobody, *aims, 1.0))
    interpolated(HeightTrack(np.arange(4.0), np.zeros(4)), np.ones(1))
    heights_by_landmark(nobody, np.empty(0), np.empty((0, 2)), np.eye(3))
    turned_rays(np.empty((0, 2)), np.zeros(3))
    fit_shift(Heights(nobody, nobody, *(np.empty(0) for _ in range(6))), 0.0, 1.0)
    return messages + len(step.flush())


def _frame(camera: Camera, seq: int, stamp_ns: int, point: Array, colors: list[str]) -> MarkerFrame:
    """A frame with a marker of every colour at one point (3,)."""
    x, y = np.nan_to_num(camera.project(point)[0]).tolist()
    markers = [
        Marker(color=color, x_px=x, y_px=y, area_px=1.0, sigma_px=0.1, quality=1.0)
        for color in colors
    ]
    return MarkerFrame(
        camera=camera.name,
        seq=seq,
        stamp_ns=stamp_ns,
        row_time_ns=0.0,
        clock_offset_ns=0,
        clock_sigma_ns=0,
        size_px=camera.size_px,
        markers=markers[:256],
    )
