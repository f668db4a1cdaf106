"""A synthetic bench for calibration: known cameras, boards at known poses, exact or noisy corners,
and rendered pictures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import pytest
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
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.lens_model import lens_vector, rays

NAMES = ("left", "right", "third", "fourth")
Detections = dict[str, dict[str, Detection]]


@dataclass(frozen=True)
class Bench:
    """Cameras, a board and its poses T_rig_from_board by key."""

    cameras: list[Camera]
    board: Board
    poses: dict[str, Array]

    def corners(self, camera: Camera, key: str) -> Array:
        """Where the camera sees the corners, exactly."""
        return camera.project(apply(self.poses[key], self.board.points))

    def detections(self, noise_px: float = 0.1, seed: int = 5) -> Detections:
        """What a detector would find: every corner of boards that are completely in the picture,
        with noise.
        """
        generator = np.random.default_rng(seed)
        found: Detections = {camera.name: {} for camera in self.cameras}
        for camera in self.cameras:
            for key in self.poses:
                pixels = self.corners(camera, key)
                inside = (
                    np.all(np.isfinite(pixels))
                    and pixels.min() > 3.0
                    and np.all(pixels < np.array(camera.size_px) - 3.0)
                )
                noisy = pixels + generator.normal(0.0, noise_px, pixels.shape)
                if inside:
                    found[camera.name][key] = Detection(
                        np.arange(self.board.size), noisy, camera.size_px
                    )
        return found

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
        """A rendered grey picture: each pixel the mean of fine x fine rays into the printed board."""
        width, height = camera.size_px
        seen = fine_rays(camera, fine)
        T = inverse(self.poses[key]) @ camera.T_rig_from_camera
        towards = np.concatenate([seen, np.ones((len(seen), 1))], axis=1) @ T[:3, :3].T
        on_board = T[:3, 3] - towards * (T[2, 3] / towards[:, 2])[:, None]
        grey = printed(self.board, on_board).reshape(height, fine, width, fine).mean(axis=(1, 3))
        grey = cv2.GaussianBlur(grey, (0, 0), blur_px)
        grey = grey + np.random.default_rng(seed).normal(0.0, noise, grey.shape)
        return np.clip(grey, 0, 255).astype(np.uint8)


def fine_rays(camera: Camera, fine: int) -> Array:
    """Rays (n, 2) of a picture of `fine` times the resolution: exact every 8 px, cubic splines
    between (1e-6 px).
    """
    width, height = camera.size_px
    coarse_x, coarse_y = (
        np.linspace(-1.0, width, width // 8 + 1),
        np.linspace(-1.0, height, height // 8 + 1),
    )
    nodes = np.stack(np.meshgrid(coarse_x, coarse_y), axis=-1).reshape(-1, 2)
    exact = rays(lens_vector(camera.matrix, camera.distortion), nodes).reshape(
        len(coarse_y), len(coarse_x), 2
    )
    x, y = (
        (np.arange(fine * width) + 0.5) / fine - 0.5,
        (np.arange(fine * height) + 0.5) / fine - 0.5,
    )
    return np.stack(
        [RectBivariateSpline(coarse_y, coarse_x, exact[..., k])(y, x).reshape(-1) for k in (0, 1)],
        axis=1,
    )


def printed(board: Board, points: Array) -> Array:
    """Grey values of a chessboard with a white margin on a grey desk, at points (n, 3) of its
    plane.
    """
    u, v = points[:, 0] / board.square_m, points[:, 1] / board.square_m
    black = (np.floor(u) + np.floor(v)) % 2 == 0
    inside = (u > -1) & (v > -1) & (u < board.cols) & (v < board.rows)
    margin = (u > -1.7) & (v > -1.7) & (u < board.cols + 0.7) & (v < board.rows + 0.7)
    return np.where(inside, np.where(black, 25.0, 190.0), np.where(margin, 190.0, 90.0))


def rig(
    count: int, size_px: tuple[int, int], focal_px: float, distortion: tuple[float, ...]
) -> list[Camera]:
    """Cameras 75 mm apart along x, none of them parallel, centred or level with another."""
    cameras = []
    for k in range(count):
        focal, centre = (
            focal_px * (1 + 0.01 * k),
            ((size_px[0] - 1) / 2 + 6 - 5 * k, size_px[1] / 2 - 4),
        )
        matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
        R = rotation_y(-0.012 * k) @ rotation_x(0.006 * k) @ rotation_z(0.008 * k)
        cameras.append(
            Camera(
                NAMES[k],
                size_px,
                matrix,
                np.array(distortion),
                transform(R, [0.075 * k, 0.001 * k, -0.002 * k]),
            )
        )
    return cameras


def hand_held(
    board: Board,
    count: int,
    tilt_deg: float,
    spread: float,
    depth_m: tuple[float, float],
    seed: int,
) -> dict[str, Array]:
    """Poses of a board held in front of the cameras, tilted and moved about."""
    generator = np.random.default_rng(seed)
    middle = board.points.mean(axis=0)
    poses = {}
    for k in range(count):
        z = generator.uniform(*depth_m)
        about_x, about_y = np.radians(generator.uniform(-tilt_deg, tilt_deg, 2))
        R = rotation_z(generator.uniform(-0.4, 0.4)) @ rotation_x(about_x) @ rotation_y(about_y)
        across, down = generator.uniform(-spread, spread, 2) * z
        poses[f"{k + 1:02d}"] = transform(
            R, np.array([0.0375 + across, 0.7 * down, z]) - R @ middle
        )
    return poses


MakeBench = Callable[..., Bench]


@pytest.fixture(scope="session")
def make_bench() -> MakeBench:
    """Builds a Bench; every argument has a sensible default."""

    def make(
        cameras: int = 2,
        positions: int = 12,
        board: Board | None = None,
        *,
        size_px: tuple[int, int] = (640, 480),
        focal_px: float = 527.3,
        distortion: tuple[float, ...] = (-0.25, 0.08, 0.001, -0.0005, 0.0),
        tilt_deg: float = 35.0,
        spread: float = 0.28,
        depth_m: tuple[float, float] = (0.35, 0.7),
        seed: int = 0,
    ) -> Bench:
        board = board or Board(9, 6, 0.025)
        return Bench(
            rig(cameras, size_px, focal_px, distortion),
            board,
            hand_held(board, positions, tilt_deg, spread, depth_m, seed),
        )

    return make
