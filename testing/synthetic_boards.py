"""A synthetic bench for calibration: known cameras, boards at known poses, corners and pictures.

Corners are exact or noisy, pictures are rendered: what the tests of the calibrator measure with.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.interpolate import RectBivariateSpline

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    rotation_x,
    rotation_y,
    rotation_z,
    transform,
)
from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection, Detections

CAMERAS = ("left", "right", "third", "fourth")
# A detector misses corners nearer to the edge of the picture.
_EDGE_PX = 3.0
# Grey values of the print and of the desk behind it.
_BLACK, _WHITE, _DESK = 25.0, 190.0, 90.0
# Rays are exact every so many px, and cubic splines between them (1e-6 px).
_RAY_STEP_PX = 8


@dataclass(frozen=True)
class Bench:
    """Cameras, a board and its poses T_rig_from_board by key."""

    cameras: list[Camera]
    board: Board
    poses: dict[str, Array]

    def corners(self, camera: Camera, key: str) -> Array:
        """Where the camera sees the corners, exactly; (n, 2) px."""
        return camera.project(apply(self.poses[key], self.board.points))

    def detections(self, noise_px: float = 0.1, seed: int = 5) -> Detections:
        """What a detector would find: all corners, with noise, of boards wholly in the picture."""
        generator = np.random.default_rng(seed)
        found: Detections = {camera.name: {} for camera in self.cameras}
        for camera in self.cameras:
            for key in self.poses:
                pixels = self.corners(camera, key)
                noisy = pixels + generator.normal(0.0, noise_px, pixels.shape)
                if is_inside(pixels, camera.size_px) and self._is_seen(camera, key, pixels):
                    ids = np.arange(self.board.size)
                    found[camera.name][key] = Detection(ids, noisy, camera.size_px)
        return found

    def _is_seen(self, camera: Camera, key: str, pixels: Array) -> bool:
        """Whether the pixels' rays are the corners': not where the lens model folds over."""
        p_camera = apply(inverse(camera.T_rig_from_camera) @ self.poses[key], self.board.points)
        return np.allclose(camera.rays_from_pixels(pixels), p_camera[:, :2] / p_camera[:, 2:])

    def picture(
        self,
        camera: Camera,
        key: str,
        *,
        blur_px: float = 0.7,
        noise: float = 2.0,
        seed: int = 1,
        fine: int = 2,
    ) -> np.ndarray:
        """A rendered grey picture (h, w): each pixel the mean of fine x fine rays to the board."""
        width, height = camera.size_px
        rays = fine_rays(camera, fine)
        T_board_from_camera = inverse(self.poses[key]) @ camera.T_rig_from_camera
        R, origin = T_board_from_camera[:3, :3], T_board_from_camera[:3, 3]
        directions = np.concatenate([rays, np.ones((len(rays), 1))], axis=1) @ R.T
        on_board = origin - directions * (origin[2] / directions[:, 2])[:, None]
        grey = printed(self.board, on_board).reshape(height, fine, width, fine).mean(axis=(1, 3))
        grey = cv2.GaussianBlur(grey, (0, 0), blur_px)
        grey = grey + np.random.default_rng(seed).normal(0.0, noise, grey.shape)
        return np.clip(grey, 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class BenchSetup:
    """What a bench is made of; the defaults are two cameras of the RHOT paper and a 9x6 board.

    The board is held in front of the cameras, tilted by up to tilt_deg and moved about by up to
    `spread` of its distance, which is drawn from depth_m.
    """

    cameras: int = 2
    positions: int = 12
    board: Board = field(default_factory=lambda: Board(9, 6, 0.025))
    size_px: tuple[int, int] = (640, 480)
    focal_px: float = 527.3
    distortion: tuple[float, ...] = (-0.25, 0.08, 0.001, -0.0005, 0.0)
    tilt_deg: float = 35.0
    spread: float = 0.28
    depth_m: tuple[float, float] = (0.35, 0.7)
    seed: int = 0

    def bench(self) -> Bench:
        """The bench, the same every time."""
        cameras = [self._camera(k) for k in range(self.cameras)]
        return Bench(cameras, self.board, self._poses())

    def _camera(self, k: int) -> Camera:
        """Cameras 75 mm apart along x, none of them parallel, centred or level with another."""
        focal = self.focal_px * (1 + 0.01 * k)
        centre = ((self.size_px[0] - 1) / 2 + 6 - 5 * k, self.size_px[1] / 2 - 4)
        matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
        R = rotation_y(-0.012 * k) @ rotation_x(0.006 * k) @ rotation_z(0.008 * k)
        T_rig_from_camera = transform(R, [0.075 * k, 0.001 * k, -0.002 * k])
        distortion = np.array(self.distortion)
        return Camera(CAMERAS[k], self.size_px, matrix, distortion, T_rig_from_camera)

    def _poses(self) -> dict[str, Array]:
        generator = np.random.default_rng(self.seed)
        middle = self.board.points.mean(axis=0)
        poses = {}
        for k in range(self.positions):
            z = generator.uniform(*self.depth_m)
            about_x, about_y = np.radians(generator.uniform(-self.tilt_deg, self.tilt_deg, 2))
            R = rotation_z(generator.uniform(-0.4, 0.4)) @ rotation_x(about_x) @ rotation_y(about_y)
            across, down = generator.uniform(-self.spread, self.spread, 2) * z
            centre = np.array([0.0375 + across, 0.7 * down, z])
            poses[f"{k + 1:02d}"] = transform(R, centre - R @ middle)
        return poses


def is_inside(pixels: Array, size_px: tuple[int, int]) -> bool:
    """Whether all pixels (n, 2) are in the picture, and not at its very edge."""
    return bool(
        np.all(np.isfinite(pixels))
        and pixels.min() > _EDGE_PX
        and np.all(pixels < np.array(size_px) - _EDGE_PX)
    )


def fine_rays(camera: Camera, fine: int) -> Array:
    """Rays (n, 2) of the pixels of a picture with `fine` times the resolution."""
    width, height = camera.size_px
    coarse_x = np.linspace(-1.0, width, width // _RAY_STEP_PX + 1)
    coarse_y = np.linspace(-1.0, height, height // _RAY_STEP_PX + 1)
    nodes = np.stack(np.meshgrid(coarse_x, coarse_y), axis=-1)
    exact = camera.rays_from_pixels(nodes).reshape(nodes.shape)
    x = (np.arange(fine * width) + 0.5) / fine - 0.5
    y = (np.arange(fine * height) + 0.5) / fine - 0.5
    return np.stack(
        [RectBivariateSpline(coarse_y, coarse_x, exact[..., k])(y, x).reshape(-1) for k in (0, 1)],
        axis=1,
    )


def printed(board: Board, points: Array) -> Array:
    """Grey values (n,) of a chessboard with a white margin on a desk, at points (n, 3) of it."""
    u, v = points[:, 0] / board.square_m, points[:, 1] / board.square_m
    black = (np.floor(u) + np.floor(v)) % 2 == 0
    inside = (u > -1) & (v > -1) & (u < board.cols) & (v < board.rows)
    margin = (u > -1.7) & (v > -1.7) & (u < board.cols + 0.7) & (v < board.rows + 0.7)
    return np.where(inside, np.where(black, _BLACK, _WHITE), np.where(margin, _WHITE, _DESK))
