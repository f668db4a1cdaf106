"""Linear light on a camera's pixels: VTK's pictures of a hand in motion before a room.

A picture is the mean of sub-frames over the exposure; each vertex is where it is when its own row
is exposed, so the shutter rolls. Sub-frames have two by two samples a pixel, shifted from one to
the next. The lens distorts afterwards. Pixel (0, 0) has its middle at (0, 0), as in OpenCV.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from rhot.geometry.camera import Camera
from testing.second_renderer.motion import Array, Play
from testing.second_renderer.paint import Painted
from testing.second_renderer.room import Light, add_lamps, add_room, matt
from testing.second_renderer.skin import Skinned

_FINE = 2
_NEAR_M, _FAR_M = 0.1, 6.0
_DECODE = (np.arange(256) / 255.0).astype(np.float32) ** 2.2
_MARGIN_PX = 10
# A vertex counts as visible within so much of what the depth buffer has there.
_SLACK_M = 0.003


@dataclass(frozen=True)
class Shutter:
    """Exposure, time from row to row (0: a global shutter), sub-frames of an exposure."""

    exposure_s: float = 0.008
    row_s: float = 30e-6
    steps: int = 4


class Taken(NamedTuple):
    """A picture's light (h, w, 3), the share of each landmark's paint that shows (6,), and pixels
    (p, 2) of each landmark's visible paint.
    """

    light: Array
    shares: Array
    paint_px: list[Array]
    # The hand's share of each pixel (h, w).
    covered: Array


class Window:
    """A VTK window off the screen of which colours and depths are read."""

    def __init__(self, size_px: tuple[int, int], *, shadows: bool) -> None:
        self.size_px = size_px
        self.window, self.renderer = vtk.vtkRenderWindow(), vtk.vtkRenderer()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*size_px)
        self.window.AddRenderer(self.renderer)
        self.renderer.SetBackground(0.0, 0.0, 0.0)
        if shadows:
            self.renderer.SetPass(_shadow_pass())

    def look(self, camera: Camera, corner_px: Array) -> None:
        """See from a camera; the window's upper left corner is that undistorted pixel."""
        width, height = self.size_px
        fx, fy = _FINE * camera.matrix[0, 0], _FINE * camera.matrix[1, 1]
        cx = _FINE * (camera.matrix[0, 2] - corner_px[0])
        cy = _FINE * (camera.matrix[1, 2] - corner_px[1])
        near, far = _NEAR_M, _FAR_M
        rows = np.array(
            [
                [2 * fx / width, 0, 1 - 2 * cx / width, 0],
                [0, 2 * fy / height, 2 * cy / height - 1, 0],
                [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
                [0, 0, -1, 0],
            ]
        )
        projection = vtk.vtkMatrix4x4()
        projection.DeepCopy(rows.ravel().tolist())
        view = self.renderer.GetActiveCamera()
        T = camera.T_rig_from_camera
        view.SetPosition(*T[:3, 3].tolist())
        view.SetFocalPoint(*(T[:3, 3] + T[:3, 2]).tolist())
        view.SetViewUp(*(-T[:3, 1]).tolist())
        view.SetClippingRange(near, far)
        view.SetExplicitProjectionTransformMatrix(projection)
        view.UseExplicitProjectionTransformMatrixOn()

    def colors(self) -> Array:
        """Draw; (h, w, 3) bytes from the upper left."""
        self.window.Render()
        width, height = self.size_px
        out = vtk.vtkUnsignedCharArray()
        self.window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, out)
        return vtk_to_numpy(out).reshape(height, width, 4)[::-1, :, :3]

    def depths(self) -> Array:
        """Distances along the axis of what was drawn last, m; (h, w)."""
        width, height = self.size_px
        out = vtk.vtkFloatArray()
        self.window.GetZbufferData(0, 0, width - 1, height - 1, out)
        z = vtk_to_numpy(out).reshape(height, width)[::-1].astype(np.float64)
        return np.asarray(_NEAR_M * _FAR_M / (_FAR_M - z * (_FAR_M - _NEAR_M)))


def _shadow_pass() -> Any:
    shadows = vtk.vtkShadowMapPass()
    shadows.GetShadowMapBakerPass().SetResolution(1024)
    steps, collection = vtk.vtkSequencePass(), vtk.vtkRenderPassCollection()
    collection.AddItem(shadows.GetShadowMapBakerPass())
    collection.AddItem(shadows)
    steps.SetPasses(collection)
    through = vtk.vtkCameraPass()
    through.SetDelegatePass(steps)
    return through


def room_light(camera: Camera, light: Light, seed: int) -> Array:
    """The room alone; (h, w, 3) of linear light."""
    width, height = camera.size_px
    pad = 40
    window = Window((_FINE * (width + 2 * pad), _FINE * (height + 2 * pad)), shadows=False)
    add_room(window.renderer, seed)
    add_lamps(window.renderer, light, np.array([0.0, 0.0, 1.5]))
    corner = np.array([-pad - 0.5, -pad - 0.5])
    window.look(camera, corner)
    # The room has lamps of its own kind, farther away.
    fine = 0.45 * _DECODE[window.colors()]
    return _distorted(camera, fine, corner, np.array([0, 0]), camera.size_px)


def _distorted(
    camera: Camera, fine: Array, corner_px: Array, begin_px: Array, size_px: tuple[int, int]
) -> Array:
    """Pixels begin_px.. of a lens from a finer pinhole's picture; (h, w, channels)."""
    width, height = size_px
    (x, y), whole = (_FINE * begin_px).tolist(), _undistorted(camera)
    flat = whole[y : y + _FINE * height, x : x + _FINE * width]
    maps = ((flat - corner_px) * _FINE - 0.5).astype(np.float32)
    drawn = cv2.remap(fine, maps, None, cv2.INTER_LINEAR)
    return np.asarray(
        drawn.reshape(height, _FINE, width, _FINE, -1).mean(axis=(1, 3), dtype=np.float32)
    )


@cache
def _undistorted(camera: Camera) -> Array:
    """Where the samples of a camera's pixels are without distortion, px; (2 h, 2 w, 2)."""
    width, height = camera.size_px
    steps_x = (np.arange(_FINE * width) + 0.5) / _FINE - 0.5
    steps_y = (np.arange(_FINE * height) + 0.5) / _FINE - 0.5
    grid = np.stack(np.meshgrid(steps_x, steps_y), axis=-1).reshape(-1, 1, 2)
    flat = cv2.undistortPoints(grid, camera.matrix, camera.distortion, P=camera.matrix)
    return np.asarray(flat.reshape(_FINE * height, _FINE * width, 2))


class Studio:
    """A painted hand before the cameras."""

    def __init__(self, play: Play, skinned: Skinned, paint: Painted, light: Light) -> None:
        self._play, self._skinned, self._paint = play, skinned, paint
        mesh = skinned.mesh
        self._points, self._normals = vtk.vtkPoints(), None
        self._data = vtk.vtkPolyData()
        cells = vtk.vtkCellArray()
        flat = np.ascontiguousarray(mesh.faces, dtype=np.int64).ravel()
        offsets = np.arange(0, len(flat) + 1, 3)
        cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(flat, deep=True))
        self._data.SetPolys(cells)
        self._data.SetPoints(self._points)
        colors = np.clip(255.0 * paint.albedo, 0, 255).astype(np.uint8)
        self._data.GetPointData().SetScalars(numpy_to_vtk(colors, deep=True))
        self._light, self._window = light, None
        self._target = np.array([*play.at, play.distance_m])

    def _ready(self, size_px: tuple[int, int]) -> Window:
        """A window that is large enough."""
        if self._window is None or any(np.array(self._window.size_px) < size_px):
            rounded = tuple(int(np.ceil(n / 128) * 128) for n in size_px)
            self._window = Window(rounded, shadows=True)
            mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
            mapper.SetInputData(self._data)
            actor.SetMapper(mapper)
            matt(actor, 0.55)
            self._window.renderer.AddActor(actor)
            add_lamps(self._window.renderer, self._light, self._target)
        return self._window

    def _show(self, vertices: Array, normals: Array) -> None:
        self._points.SetData(numpy_to_vtk(vertices.astype(np.float32), deep=True))
        self._data.GetPointData().SetNormals(numpy_to_vtk(normals.astype(np.float32), deep=True))
        self._points.Modified()
        self._data.Modified()

    def take(self, camera: Camera, room: Array, time_s: float, shutter: Shutter) -> Taken:
        """The picture whose row 0 is exposed about time_s."""
        height = camera.size_px[1]
        half_s = 0.5 * (shutter.row_s * height + shutter.exposure_s)
        middle_s = time_s + 0.5 * shutter.row_s * height
        at_s = middle_s + half_s * np.array([-1.0, 0.0, 1.0])
        bones = self._play.bones(at_s)
        posed = [self._skinned.pose(*(part[k] for part in bones)) for k in range(3)]
        places = np.stack([vertices for vertices, _ in posed])  # (3, v, 3)
        rows = _project(camera, places[1])[:, 1]
        light, covered, begin = None, None, np.zeros(2, dtype=int)
        shares, paint_px = np.zeros(6), []
        for step in range(shutter.steps):
            offset_s = shutter.exposure_s * ((step + 0.5) / shutter.steps - 0.5)
            for _ in range(2):
                s = (time_s + offset_s + shutter.row_s * rows - middle_s)[:, None] / half_s
                vertices = (
                    places[1] + 0.5 * s * (places[2] - places[0])
                    + 0.5 * s * s * (places[2] + places[0] - 2.0 * places[1])
                )  # fmt: skip
                rows = np.clip(_rows(camera, vertices), -50.0, height + 50.0)
            self._show(vertices, posed[1][1])
            if light is None:
                begin, size = _box(camera, vertices)
                light = np.zeros((size[1], size[0], 3), np.float32)
                covered = np.zeros((size[1], size[0], 1), np.float32)
            shift = (np.array([step % 2, step // 2 % 2]) - 0.5) * 0.25
            corner = begin - _MARGIN_PX - 0.5 + shift
            fine_px = tuple(int(n) for n in _FINE * (np.array(size) + 2 * _MARGIN_PX))
            window = self._ready(fine_px)
            window.look(camera, corner)
            drawn = window.colors()
            depths = window.depths()
            mask = (depths < 0.9 * _FAR_M).astype(np.float32)
            fine = np.dstack([_DECODE[drawn], mask])
            own = _distorted(camera, fine, corner, begin, size)
            light += own[..., :3] / shutter.steps
            covered += own[..., 3:] / shutter.steps
            if step == shutter.steps // 2:
                shares, paint_px = self._visible(camera, vertices, posed[1][1], depths, corner)
        assert light is not None and covered is not None
        picture = room.copy()
        x, y = begin.tolist()
        part = picture[y : y + light.shape[0], x : x + light.shape[1]]
        part[:] = part * (1.0 - covered) + light
        whole = np.zeros(picture.shape[:2], np.float32)
        whole[y : y + light.shape[0], x : x + light.shape[1]] = covered[..., 0]
        return Taken(picture, shares, paint_px, whole)

    def _visible(
        self, camera: Camera, vertices: Array, normals: Array, depths: Array, corner: Array
    ) -> tuple[Array, list[Array]]:
        T = camera.T_camera_from_rig
        local = vertices @ T[:3, :3].T + T[:3, 3]
        facing = -np.sum((normals @ T[:3, :3].T) * local, axis=1) / np.linalg.norm(local, axis=1)
        flat = local[:, :2] / local[:, 2:] * np.diag(camera.matrix)[:2] + camera.matrix[:2, 2]
        fine = np.round((flat - corner) * _FINE - 0.5).astype(int)
        height, width = depths.shape
        inside = (fine >= 0).all(axis=1) & (fine[:, 0] < width) & (fine[:, 1] < height)
        clipped = np.clip(fine, 0, [width - 1, height - 1])
        nearest = depths[clipped[:, 1], clipped[:, 0]]
        seen_px = _project(camera, vertices)
        limit = np.array(camera.size_px) - 0.5
        inside &= (seen_px > -0.5).all(axis=1) & (seen_px < limit).all(axis=1)
        seen = inside & (local[:, 2] < nearest + _SLACK_M)
        shares, pixels = np.zeros(6), []
        for row in range(6):
            front = np.where(facing > 0.1, facing, 0.0) * (self._paint.share[:, row] > 0.5)
            shares[row] = float((front * seen).sum() / max(front.sum(), 1e-9))
            core = (self._paint.share[:, row] > 0.99) & (facing > 0.4) & seen
            pixels.append(seen_px[core])
        return shares, pixels


def _project(camera: Camera, points: Array) -> Array:
    """Pixels (p, 2) of points (p, 3) in the rig's frame, by OpenCV."""
    T = camera.T_camera_from_rig
    turn = cv2.Rodrigues(T[:3, :3])[0]
    found, _ = cv2.projectPoints(points, turn, T[:3, 3], camera.matrix, camera.distortion)
    return np.asarray(found[:, 0])


def _rows(camera: Camera, points: Array) -> Array:
    """About the rows of points (p, 3): with the largest part of the distortion."""
    T = camera.T_camera_from_rig
    local = points @ T[:3, :3].T + T[:3, 3]
    x, y = local[:, 0] / local[:, 2], local[:, 1] / local[:, 2]
    bent = 1.0 + camera.distortion[0] * (x * x + y * y)
    return np.asarray(camera.matrix[1, 1] * bent * y + camera.matrix[1, 2])


def _box(camera: Camera, vertices: Array) -> tuple[np.ndarray, tuple[int, int]]:
    """Upper left pixel, and width and height, of what a hand may touch, inside the picture."""
    seen = _project(camera, vertices)
    width, height = camera.size_px
    low = np.clip(np.floor(seen.min(axis=0)).astype(int) - 8, 0, [width - 2, height - 2])
    high = np.clip(np.ceil(seen.max(axis=0)).astype(int) + 8, low + 1, [width, height])
    return low, (int(high[0] - low[0]), int(high[1] - low[1]))
