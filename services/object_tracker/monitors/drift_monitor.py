"""Markers and object poses, matched: every registered object whose tracker carries paint.

Pure; time is that of the messages. Memory is bounded, whatever arrives.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rhot.files.calibration import ObjectPlace, Objects
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    rotation_from_quaternion,
    transform,
)
from rhot.messages import MarkerFrame
from rhot.messages.objects import ObjectPose
from services.object_tracker.monitors.drift_watch import Drift, DriftWatch, PaintSighting
from services.object_tracker.monitors.pose_track import PoseTrack

# Two seconds of four cameras at 60 Hz.
_MAX_PENDING = 500
# Blobs of one colour that a picture may have; further ones are not the paint.
_MAX_BLOBS = 4


class _Blob(NamedTuple):
    instant_ns: int
    pixel: tuple[float, float]
    area_px: float


@dataclass(eq=False)
class _Watched:
    name: str
    color: str
    paint_m: Array  # (3,) in the object's frame
    watch: DriftWatch
    track: PoseTrack = field(default_factory=PoseTrack)
    # Each camera's pictures that wait for the look: index of the camera, its blobs.
    pending: deque[tuple[int, list[_Blob]]] = field(
        default_factory=lambda: deque(maxlen=_MAX_PENDING)
    )


class DriftMonitor:
    """The watches of all objects whose tracker carries paint that the registration knows."""

    def __init__(self, config: RigConfig, objects: Objects, cameras: Mapping[str, Camera]) -> None:
        """objects is what poses are registered with."""
        self._cameras = tuple(cameras.values())
        self._index = {name: number for number, name in enumerate(cameras)}
        sigma_m = (objects.sigma_m or 0.0) / np.sqrt(3.0)
        self._watched: dict[str, _Watched] = {}
        for name, color in watched_colors(config, objects).items():
            watch = DriftWatch(self._cameras, float(sigma_m))
            self._watched[name] = _Watched(name, color, _paint(objects.objects[name]), watch)

    def take_object(self, pose: ObjectPose, T_rig_from_before: Array | None = None) -> None:
        """An object's pose; T_rig_from_before (4, 4) is the correction that it has already."""
        one = self._watched.get(pose.object)
        if one is None or pose.tracking != "ok" or not pose.registered:
            return
        T = transform(rotation_from_quaternion(pose.orientation_wxyz), pose.position_m)
        if T_rig_from_before is not None:
            T = inverse(T_rig_from_before) @ T
        one.track.add(pose.stamp_ns, T)

    def take_frame(self, frame: MarkerFrame) -> None:
        """Markers of one camera."""
        camera = self._index.get(frame.camera)
        if camera is None or tuple(frame.size_px) != tuple(self._cameras[camera].size_px):
            return
        start_ns = frame.stamp_ns - frame.clock_offset_ns
        for one in self._watched.values():
            blobs = [
                _Blob(start_ns + _row_ns(marker.y_px, frame), (marker.x_px, marker.y_px), area_px)
                for marker in frame.markers
                if marker.color == one.color
                and _inside(marker.x_px, marker.y_px, frame.size_px)
                and 0.0 < (area_px := marker.area_px) < 1e9
            ]
            if blobs:
                one.pending.append((camera, blobs[:_MAX_BLOBS]))

    def look(self, now_ns: int) -> dict[str, Drift]:
        """What has drifted by now, by object; about once a second."""
        for one in self._watched.values():
            for camera, blobs in one.pending:
                if sighting := self._matched(one, camera, blobs):
                    one.watch.observe(sighting)
            one.pending.clear()
            one.watch.look(now_ns * 1e-9)
        return {one.name: one.watch.drift for one in self._watched.values() if one.watch.drift}

    def distances_m(self) -> dict[str, float]:
        """The newest difference of each object that could be compared."""
        return {
            one.name: one.watch.distance_m
            for one in self._watched.values()
            if one.watch.distance_m is not None
        }

    def color_of(self, name: str) -> str:
        """The colour of the paint on an object's tracker."""
        return self._watched[name].color

    def _matched(self, one: _Watched, camera: int, blobs: list[_Blob]) -> PaintSighting | None:
        """The blob that is nearest to where the paint should be."""
        T_rig_from_object = one.track.at(blobs[0].instant_ns)
        if T_rig_from_object is None:
            return None
        p_rig = apply(T_rig_from_object, one.paint_m)
        if len(blobs) > 1:
            there = self._cameras[camera].project(p_rig)[0]
            distances = [float(np.hypot(*(blob.pixel - there))) for blob in blobs]
            blobs = [blobs[int(np.argmin(np.nan_to_num(distances, nan=np.inf)))]]
        blob = blobs[0]
        instant_s = blob.instant_ns * 1e-9
        return PaintSighting(
            camera, instant_s, blob.pixel, blob.area_px, p_rig, T_rig_from_object[:3, :3]
        )


def watched_colors(config: RigConfig, objects: Objects | None) -> dict[str, str]:
    """Colour of the paint by object, of those that can be watched."""
    places = objects.objects if objects else {}
    return {
        table.name: table.marker
        for table in config.object
        if table.marker and table.name in places and places[table.name].marker_m
    }


def _paint(place: ObjectPlace) -> Array:
    """The paint in the object's frame; (3,)."""
    R = rotation_from_quaternion(place.orientation_wxyz)
    T_tracker_from_object = transform(R, place.offset_m)
    return apply(inverse(T_tracker_from_object), np.array(place.marker_m))


def _row_ns(y_px: float, frame: MarkerFrame) -> int:
    return round(min(max(y_px, 0.0), frame.size_px[1]) * frame.row_time_ns)


def _inside(x_px: float, y_px: float, size_px: tuple[int, int]) -> bool:
    return -0.5 <= x_px <= size_px[0] - 0.5 and -0.5 <= y_px <= size_px[1] - 0.5
