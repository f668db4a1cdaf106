"""VTK's windows off the screen, as a pinhole sees the rig, and what a lens makes of their pictures.

Windows have two by two samples a pixel. Pixel (0, 0) has its middle at (0, 0), as in OpenCV.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from rhot.geometry.camera import Camera
from testing.second_renderer.motion import Array
from testing.second_renderer.room import Light, add_lamps, add_room

# Samples a pixel, each way.
FINE = 2
NEAR_M, FAR_M = 0.1, 6.0
Bytes = npt.NDArray[np.uint8]
Light32 = npt.NDArray[np.float32]
# VTK's colours are light to the power 1 / 2.2.
DECODE: Light32 = (np.arange(256) / 255.0).astype(np.float32) ** np.float32(2.2)
# How strong lamps are on the walls, which are farther away, and how far its picture reaches beyond
# the camera's.
_ROOM_SHARE, _ROOM_PAD_PX = 0.45, 40
# Not that there is no display.
vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)


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
        self._shadows = _shadow_pass() if shadows else None
        if shadows:
            self.renderer.SetPass(self._shadows)

    def look(self, camera: Camera, corner_px: Array) -> None:
        """See from a camera; the window's upper left corner is that undistorted pixel."""
        width, height = self.size_px
        fx, fy = FINE * camera.matrix[0, 0], FINE * camera.matrix[1, 1]
        cx = FINE * (camera.matrix[0, 2] - corner_px[0])
        cy = FINE * (camera.matrix[1, 2] - corner_px[1])
        near, far = NEAR_M, FAR_M
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

    def close(self) -> None:
        """Give back what it holds; it draws no more."""
        if self._shadows is not None:
            self._shadows.ReleaseGraphicsResources(self.window)
        self.window.Finalize()

    def colors(self) -> Bytes:
        """Draw; (h, w, 3) bytes from the upper left."""
        self.window.Render()
        width, height = self.size_px
        out = vtk.vtkUnsignedCharArray()
        self.window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, out)
        return np.asarray(vtk_to_numpy(out).reshape(height, width, 4)[::-1, :, :3])

    def depths(self) -> Array:
        """Distances along the axis of what was drawn last, m; (h, w)."""
        width, height = self.size_px
        out = vtk.vtkFloatArray()
        self.window.GetZbufferData(0, 0, width - 1, height - 1, out)
        z = vtk_to_numpy(out).reshape(height, width)[::-1].astype(np.float64)
        return np.asarray(NEAR_M * FAR_M / (FAR_M - z * (FAR_M - NEAR_M)))


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


def room_light(camera: Camera, light: Light, seed: int) -> Light32:
    """The room alone; (h, w, 3) of linear light."""
    width, height = camera.size_px
    pad = _ROOM_PAD_PX
    window = Window((FINE * (width + 2 * pad), FINE * (height + 2 * pad)), shadows=False)
    add_room(window.renderer, seed)
    add_lamps(window.renderer, light, np.array([0.0, 0.0, 1.5]))
    corner = np.array([-pad - 0.5, -pad - 0.5])
    window.look(camera, corner)
    fine = np.float32(_ROOM_SHARE) * DECODE[window.colors()]
    window.close()
    return distorted(camera, fine, corner, np.zeros(2, dtype=np.int64), camera.size_px)


def distorted(
    camera: Camera,
    fine: Light32,
    corner_px: Array,
    begin_px: npt.NDArray[np.int64],
    size_px: tuple[int, int],
) -> Light32:
    """Pixels begin_px.. of a lens from a finer pinhole's picture; (h, w, channels)."""
    width, height = size_px
    (x, y), whole = (FINE * begin_px).tolist(), _undistorted(camera)
    flat = whole[y : y + FINE * height, x : x + FINE * width]
    places = ((flat - corner_px) * FINE - 0.5).astype(np.float32)
    columns, rows = (np.ascontiguousarray(places[..., k]) for k in range(2))
    drawn = cv2.remap(fine, columns, rows, cv2.INTER_LINEAR)
    return np.asarray(
        drawn.reshape(height, FINE, width, FINE, -1).mean(axis=(1, 3), dtype=np.float32)
    )


@cache
def _undistorted(camera: Camera) -> Array:
    """Where the samples of a camera's pixels are without distortion, px; (2 h, 2 w, 2)."""
    width, height = camera.size_px
    steps_x = (np.arange(FINE * width) + 0.5) / FINE - 0.5
    steps_y = (np.arange(FINE * height) + 0.5) / FINE - 0.5
    grid = np.stack(np.meshgrid(steps_x, steps_y), axis=-1).reshape(-1, 1, 2)
    flat = cv2.undistortPoints(grid, camera.matrix, camera.distortion, P=camera.matrix)
    return np.asarray(flat.reshape(FINE * height, FINE * width, 2))
