"""Where the camera stands and what its lens does; of each pixel, where it looks in a plane.

The plane's frame: x right, y down as the picture shows them, z away from the camera; mm. The
finger moves in z = 0; what lies behind is in a plane of greater z.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import Array, rotation_x, rotation_y, rotation_z

# Of a phone or a webcam. Near enough that the hand fills the picture, and far enough that this
# height is seen: reference rectangle, finger and thumb.
_HFOV_DEG, _NEAREST_MM, _HEIGHT_MM = 44.0, 295.0, 178.0
# Where the camera looks in the plane, so that the open hand and the fist are both in view.
_AIM_MM = (0.0, 12.0)
Picture = npt.NDArray[np.float32]


class ViewOptions(NamedTuple):
    """size_px; k1, k2 of the lens; tilt_deg of the optical axis against the plane's normal, in a
    direction of the seed's; roll_deg about the axis.
    """

    size_px: tuple[int, int] = (640, 480)
    k1: float = -0.18
    k2: float = 0.05
    tilt_deg: float = 10.0
    roll_deg: float = 2.0


class View(NamedTuple):
    """camera in metres, as rhot's cameras are; its rig frame is the plane's. homography takes mm
    of z = 0 to pixels of a picture without distortion.
    """

    camera: Camera
    homography: Array  # (3, 3)

    def pixels(self, points_mm: npt.ArrayLike, z_mm: float = 0.0) -> Array:
        """Where points (n, 2) of a plane are seen, lens included; (n, 2) px."""
        flat = np.asarray(points_mm, dtype=np.float64).reshape(-1, 2)
        return self.camera.project(
            np.concatenate([flat, np.full((len(flat), 1), z_mm)], axis=1) / 1000.0
        )

    def directions(self) -> Array:
        """Where each pixel looks, in the plane's frame; (h, w, 3), a second's work."""
        width, height = self.camera.size_px
        rows, columns = np.mgrid[0:height, 0:width]
        rays = self.camera.rays_from_pixels(np.stack([columns, rows], axis=-1).reshape(-1, 2))
        T = self.camera.T_rig_from_camera
        return (rays @ T[:3, :2].T + T[:3, 2]).reshape(height, width, 3)

    def plane(self, directions: Array, z_mm: float = 0.0) -> Picture:
        """What each pixel sees of a plane; (h, w, 2) mm."""
        centre = self.camera.centre_rig
        reach = (z_mm / 1000.0 - centre[2]) / directions[..., 2:]
        return (1000.0 * (centre[:2] + reach * directions[..., :2])).astype(np.float32)


def place_camera(options: ViewOptions, seed: int) -> View:
    """A camera that looks at the middle of the plane; the seed chooses to which side it tilts."""
    rng = np.random.default_rng((seed, 2))
    # A camera on a desk stands low or high and to a side: mostly about the vertical axis.
    side = rng.choice((-1.0, 1.0)) * rng.uniform(0.5, 1.0)
    tilt = np.radians(options.tilt_deg) * np.array([np.sqrt(1.0 - side * side), side])
    R = rotation_z(np.radians(options.roll_deg)) @ rotation_y(tilt[1]) @ rotation_x(tilt[0])
    matrix = pinhole(options.size_px, np.radians(_HFOV_DEG))
    distance = max(_NEAREST_MM, _HEIGHT_MM * matrix[1, 1] / options.size_px[1])
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = (np.array([*_AIM_MM, 0.0]) - R[:, 2] * distance) / 1000.0
    camera = Camera(
        name="side",
        size_px=options.size_px,
        matrix=matrix,
        distortion=np.array([options.k1, options.k2, 0.0, 0.0, 0.0]),
        T_rig_from_camera=T,
    )
    back = camera.T_camera_from_rig
    flat = np.stack([back[:3, 0] / 1000.0, back[:3, 1] / 1000.0, back[:3, 3]], axis=1)
    homography = camera.matrix @ flat
    return View(camera, homography / homography[2, 2])
