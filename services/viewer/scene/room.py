"""What stands still in the scene: grid, axes, cameras, and where one looks from first."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import apply, quaternion_from_rotation

# What the viewer looks at first, in the first camera's frame: hands work half a metre in front of
# the cameras (RHOT section 6).
_LOOK_AT_CAMERA = np.array([0.09, 0.02, 0.48])
# From behind and above the cameras, to the right: the hand in the middle, its fingers apart, the
# frusta still in view.
_VIEWPOINT_CAMERA = np.array([0.36, -0.36, -0.26])
_FOV_RAD = float(np.deg2rad(34.0))
# A desk is some 20 cm under the cameras.
_GRID_CAMERA = np.array([0.0, 0.2, 0.5])
# In a world frame the desk is at z = 0.
_ON_DESK = np.array([1.0, 1.0, 0.0])


def add_room(server: viser.ViserServer, config: RigConfig, cameras: Mapping[str, Camera]) -> None:
    """Up direction, grid, first viewpoint and frusta.

    y is down in a camera's frame; a world frame has z up and its desk at z = 0.
    """
    scene, world = server.scene, config.rig.world
    T_rig_from_camera = np.eye(4) if world is None else np.array(world.T_rig_from_camera)
    scene.set_up_direction("-y" if world is None else "+z")
    # viser's default lighting washes out the colours, which have a meaning here.
    scene.configure_environment_map(environment_intensity=0.35)
    scene.add_grid(
        "/grid",
        width=1.2,
        height=1.2,
        plane="xz" if world is None else "xy",
        cell_size=0.05,
        section_size=0.1,
        cell_color=(225, 225, 225),
        section_color=(190, 190, 190),
        position=apply(T_rig_from_camera, _GRID_CAMERA) * (1.0 if world is None else _ON_DESK),
    )
    scene.add_frame("/rig", axes_length=0.04, axes_radius=0.0012)
    server.initial_camera.position = apply(T_rig_from_camera, _VIEWPOINT_CAMERA)
    server.initial_camera.look_at = apply(T_rig_from_camera, _LOOK_AT_CAMERA)
    server.initial_camera.fov = _FOV_RAD
    for camera in cameras.values():
        _add_frustum(scene, camera)


def _add_frustum(scene: viser.SceneApi, camera: Camera) -> None:
    width, height = camera.size_px
    scene.add_camera_frustum(
        f"/cameras/{camera.name}",
        fov=float(2.0 * np.arctan2(height / 2.0, camera.focal_px[1])),
        aspect=width / height,
        scale=0.035,
        thickness=0.0006,
        color=(60, 60, 60),
        wxyz=quaternion_from_rotation(camera.T_rig_from_camera[:3, :3]),
        position=camera.centre_rig,
    )
    scene.add_label(f"/cameras/{camera.name}/name", camera.name)
