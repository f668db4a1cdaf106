"""Compiles (or loads from numba's cache) everything fusion calls, before the first frame is there.

With a cache (rhot.process.numba_cache) this takes .3 s, without one 12 s;
a service that did it at its first frame would stand still for that long.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandModel, HandName
from rhot.messages import Marker, MarkerFrame
from services.fusion.geometry.triangulation import extrinsics
from services.fusion.output.paint_centroid import located_shift, shift_table
from services.fusion.step import FusionStep

# Enough frames of each camera for a track to begin, to be filtered anew, smoothed, and for a lesson
# of the clocks.
_FRAMES = 8


def warm_up(
    config: RigConfig, cameras: Mapping[str, Camera], hands: Mapping[HandName, HandModel]
) -> int:
    """Run a scratch FusionStep over a still point half a metre before the cameras.

    How many messages it made.
    """
    step = FusionStep(config, cameras, hands)
    first = next(iter(cameras.values()))
    point = first.T_rig_from_camera @ [0.0, 0.0, 0.5, 1.0]
    told = 0
    for seq in range(_FRAMES):
        for n, camera in enumerate(cameras.values()):
            x, y = np.nan_to_num(camera.project(point[:3])[0]).tolist()
            markers = [
                Marker(color=c, x_px=x, y_px=y, area_px=1.0, sigma_px=0.1, quality=1.0)
                for c in config.colors
            ]
            frame = MarkerFrame(
                camera=camera.name,
                seq=seq,
                stamp_ns=10**18 + round((seq + 0.3 * n) * 1e9 / 30.0),
                row_time_ns=0.0,
                clock_offset_ns=0,
                clock_sigma_ns=0,
                size_px=camera.size_px,
                markers=markers[:256],
            )
            told += len(step.step(frame))
    # What only a pose from the solver would call.
    R, t = extrinsics(tuple(cameras.values()))
    located_shift(
        shift_table(0.007, 0.014), point[:3].copy(), np.array([0.0, -1.0, 0.0]), R, t, np.zeros(3)
    )
    return told + len(step.flush())
