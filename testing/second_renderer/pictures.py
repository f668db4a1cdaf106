"""Pictures of a hand in motion before a room: linear light on a camera's pixels, drawn by VTK.

A picture is the mean of sub-frames over the exposure, their samples shifted from one to the next.
Each vertex is where it is when its own row is exposed, so the shutter rolls. The lens distorts
afterwards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from rhot.geometry.camera import Camera
from testing.second_renderer.motion import Array, Bones
from testing.second_renderer.paint import Painted
from testing.second_renderer.room import Light, add_lamps, matt
from testing.second_renderer.skin import Skinned
from testing.second_renderer.window import DECODE, FAR_M, FINE, Light32, Window, distorted

_MARGIN_PX = 10
# A vertex counts as visible within so much of what the depth buffer has there.
_SLACK_M = 0.003
# Paint counts as seen where it faces the camera by more than this (cosine), and as clearly seen.
_FACING, _CLEAR = 0.1, 0.4


@dataclass(frozen=True)
class Shutter:
    """Exposure, time from row to row (0: a global shutter), sub-frames of an exposure."""

    exposure_s: float = 0.008
    row_s: float = 30e-6
    steps: int = 3


class Taken(NamedTuple):
    """A picture's light (h, w, 3), the share of each landmark's paint that shows (6,), pixels (p,
    2) of each landmark's visible paint, and the hand's share of each pixel (h, w).
    """

    light: Light32
    shares: Array
    paint_px: list[Array]
    covered: Light32


class _Sweep:
    """Where vertices are during a frame: a parabola through three instants."""

    def __init__(self, posed: list[tuple[Array, Array]], middle_s: float, half_s: float) -> None:
        before, self.middle, after = (vertices for vertices, _ in posed)
        self.normals = posed[1][1]
        self._slope, self._bend = 0.5 * (after - before), 0.5 * (after + before) - self.middle
        self._middle_s, self._half_s = middle_s, half_s

    def at(self, times_s: Array) -> Array:
        """Each vertex at a time of its own (v,); (v, 3)."""
        s = ((times_s - self._middle_s) / self._half_s)[:, None]
        return np.asarray(self.middle + s * self._slope + s * s * self._bend)


class Studio:
    """A painted hand before the cameras; bones_at gives its bones at n instants (s)."""

    def __init__(
        self,
        bones_at: Callable[[Array], Bones],
        skinned: Skinned,
        paint: Painted,
        light: Light,
    ) -> None:
        self._bones_at, self._skinned, self._paint, self._light = bones_at, skinned, paint, light
        self._points, self._data = vtk.vtkPoints(), vtk.vtkPolyData()
        cells = vtk.vtkCellArray()
        flat = np.ascontiguousarray(skinned.mesh.faces, dtype=np.int64).ravel()
        offsets = np.arange(0, len(flat) + 1, 3)
        cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(flat, deep=True))
        self._data.SetPolys(cells)
        self._data.SetPoints(self._points)
        colors = np.clip(255.0 * paint.albedo, 0, 255).astype(np.uint8)
        self._data.GetPointData().SetScalars(numpy_to_vtk(colors, deep=True))
        self._window: Window | None = None

    def take(self, camera: Camera, room: Light32, time_s: float, shutter: Shutter) -> Taken:
        """The picture whose row 0 is exposed about time_s, before a room's light (h, w, 3)."""
        height = camera.size_px[1]
        half_s = 0.5 * (shutter.row_s * height + shutter.exposure_s)
        middle_s = time_s + 0.5 * shutter.row_s * height
        bones = self._bones_at(middle_s + half_s * np.array([-1.0, 0.0, 1.0]))
        posed = [self._skinned.pose(*(part[k] for part in bones)) for k in range(3)]
        sweep = _Sweep(posed, middle_s, half_s)
        rows = _rows(camera, sweep.middle)
        begin, size_px = _box(camera, np.concatenate([vertices for vertices, _ in posed]))
        own = np.zeros((size_px[1], size_px[0], 4), np.float32)
        shares, paint_px = np.zeros(6), list[Array]()
        for step in range(shutter.steps):
            offset_s = shutter.exposure_s * ((step + 0.5) / shutter.steps - 0.5)
            for _ in range(2):
                vertices = sweep.at(time_s + offset_s + shutter.row_s * rows)
                rows = np.clip(_rows(camera, vertices), -50.0, height + 50.0)
            shift = (np.array([step % 2, step // 2 % 2]) - 0.5) * 0.25
            corner = begin - _MARGIN_PX - 0.5 + shift
            self._show(vertices, sweep.normals)
            fine, depths = self._drawn(camera, corner, size_px)
            own += distorted(camera, fine, corner, begin, size_px) / shutter.steps
            if step == shutter.steps // 2:
                shares, paint_px = self._visible(camera, vertices, sweep.normals, depths, corner)
        picture, covered = room.copy(), np.zeros(room.shape[:2], np.float32)
        there = np.s_[begin[1] : begin[1] + size_px[1], begin[0] : begin[0] + size_px[0]]
        picture[there] = picture[there] * (1.0 - own[..., 3:]) + own[..., :3]
        covered[there] = own[..., 3]
        return Taken(picture, shares, paint_px, covered)

    def close(self) -> None:
        """Give back what its window holds."""
        if self._window is not None:
            self._window.close()

    def _show(self, vertices: Array, normals: Array) -> None:
        self._points.SetData(numpy_to_vtk(vertices.astype(np.float32), deep=True))
        self._data.GetPointData().SetNormals(numpy_to_vtk(normals.astype(np.float32), deep=True))
        self._points.Modified()
        self._data.Modified()

    def _drawn(
        self, camera: Camera, corner: Array, size_px: tuple[int, int]
    ) -> tuple[Light32, Array]:
        """Light and share of the hand (h, w, 4), and distances (h, w), at all samples."""
        wanted = FINE * (np.array(size_px) + 2 * _MARGIN_PX)
        if self._window is None or any(np.array(self._window.size_px) < wanted):
            width, height = (128 * np.ceil(wanted / 128).astype(int)).tolist()
            self.close()
            self._window = Window((width, height), shadows=True)
            mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
            mapper.SetInputData(self._data)
            actor.SetMapper(mapper)
            matt(actor, 0.55)
            self._window.renderer.AddActor(actor)
            middle = np.array(self._data.GetCenter())
            add_lamps(self._window.renderer, self._light, middle)
        self._window.look(camera, corner)
        light, depths = DECODE[self._window.colors()], self._window.depths()
        mask = (depths < 0.9 * FAR_M).astype(np.float32)
        return np.dstack([light, mask]), depths

    def _visible(
        self, camera: Camera, vertices: Array, normals: Array, depths: Array, corner: Array
    ) -> tuple[Array, list[Array]]:
        """Shares (6,) of paint that shows, of what faces the camera; pixels where it does."""
        T = camera.T_camera_from_rig
        local = vertices @ T[:3, :3].T + T[:3, 3]
        facing = -np.sum((normals @ T[:3, :3].T) * local, axis=1) / np.linalg.norm(local, axis=1)
        flat = local[:, :2] / local[:, 2:] * np.diag(camera.matrix)[:2] + camera.matrix[:2, 2]
        fine = np.round((flat - corner) * FINE - 0.5).astype(int)
        height, width = depths.shape
        inside = (fine >= 0).all(axis=1) & (fine[:, 0] < width) & (fine[:, 1] < height)
        clipped = np.clip(fine, 0, [width - 1, height - 1])
        seen_px, limit = _project(camera, vertices), np.array(camera.size_px) - 0.5
        inside &= (seen_px > -0.5).all(axis=1) & (seen_px < limit).all(axis=1)
        seen = inside & (local[:, 2] < depths[clipped[:, 1], clipped[:, 0]] + _SLACK_M)
        shares, pixels = np.zeros(6), []
        for row, share in enumerate(self._paint.share.T):
            front = np.where(facing > _FACING, facing, 0.0) * (share > 0.5)
            shares[row] = float((front * seen).sum() / max(front.sum(), 1e-9))
            pixels.append(seen_px[(share > 0.99) & (facing > _CLEAR) & seen])
        return shares, pixels


def _project(camera: Camera, points: Array) -> Array:
    """Pixels (p, 2) of points (p, 3) in the rig's frame, by OpenCV."""
    T = camera.T_camera_from_rig
    turn = cv2.Rodrigues(T[:3, :3])[0]
    found, _ = cv2.projectPoints(points, turn, T[:3, 3], camera.matrix, camera.distortion)
    return np.asarray(found[:, 0])


def _rows(camera: Camera, points: Array) -> Array:
    """About the rows (p,) of points (p, 3): with the largest part of the distortion."""
    T = camera.T_camera_from_rig
    local = points @ T[:3, :3].T + T[:3, 3]
    x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
    bent = 1.0 + camera.distortion[0] * (x * x + y * y)
    return np.asarray(camera.matrix[1, 1] * bent * y + camera.matrix[1, 2])


def _box(camera: Camera, vertices: Array) -> tuple[npt.NDArray[np.int64], tuple[int, int]]:
    """Upper left pixel, and width and height, of what a hand may touch, inside the picture."""
    seen = _project(camera, vertices)
    size_px = np.array(camera.size_px)
    low = np.clip(np.floor(seen.min(axis=0)).astype(np.int64) - 8, 0, size_px - 2)
    high = np.clip(np.ceil(seen.max(axis=0)).astype(np.int64) + 8, low + 1, size_px)
    width, height = (high - low).tolist()
    return low, (width, height)
