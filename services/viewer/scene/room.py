"""What stands still in the scene: grid, axes, cameras, and where one looks from first."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, apply, quaternion_from_rotation

# Where hands work, in the first camera's frame: half a metre in front (RHOT section 6).
_HANDS_CAMERA = np.array([0.0, 0.0, 0.5])
# One looks from behind and above the cameras, from the right: fingers apart, not one behind the
# other.
_AHEAD = np.array([-0.31, 0.437, 0.85])
_FOV_RAD = float(np.deg2rad(34.0))
# What the picture is to hold about the hands, in metres: one hand with an object beside it, or
# both. A phone is held upright, and has no more than its width for them.
_HEIGHT_M, _HEIGHT_OF_TWO_M = 0.40, 0.50
_WIDTH_M, _WIDTH_OF_TWO_M = 0.30, 0.46
# Objects lie to the right of a hand, and an upright page's panel covers its lower half when it is
# open: hands are shown so much further left, or up, in shares of the width and of the height.
_LEFT, _ABOVE_PANEL = 0.08, 0.17
# A page of 1280x800 with the panel beside the scene.
_USUAL_ASPECT = 1.1
# A desk is some 20 cm under the cameras.
_GRID_CAMERA = np.array([0.0, 0.2, 0.5])
# In a world frame the desk is at z = 0.
_ON_DESK = np.array([1.0, 1.0, 0.0])


def first_view(aspect: float, hands: int) -> tuple[Array, Array]:
    """Where one looks from first, and at what; (3,) each, in the first camera's frame.

    aspect is the scene's width over its height, hands how many there are to be seen.
    """
    ahead = _AHEAD / np.linalg.norm(_AHEAD)
    right = np.cross(ahead, [0.0, -1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    two = hands > 1
    if aspect >= 1.0:
        height = _HEIGHT_OF_TWO_M if two else _HEIGHT_M
        look_at = _HANDS_CAMERA + _LEFT * aspect * height * right
    else:
        height = (_WIDTH_OF_TWO_M if two else _WIDTH_M) / max(aspect, 0.2)
        look_at = _HANDS_CAMERA + _ABOVE_PANEL * height * down
    return look_at - 0.5 * height / np.tan(0.5 * _FOV_RAD) * ahead, look_at


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
    viewpoint, look_at = first_view(_USUAL_ASPECT, len(config.hand))
    server.initial_camera.position = apply(T_rig_from_camera, viewpoint)
    server.initial_camera.look_at = apply(T_rig_from_camera, look_at)
    server.initial_camera.fov = _FOV_RAD

    # A coroutine: viser runs it before it tells of the next visitor.
    async def connected(client: viser.ClientHandle) -> None:
        if client.camera.aspect < 0.8 * _USUAL_ASPECT:
            viewpoint, look_at = first_view(client.camera.aspect, len(config.hand))
            client.camera.position = apply(T_rig_from_camera, viewpoint)
            client.camera.look_at = apply(T_rig_from_camera, look_at)

    server.on_client_connect(connected)
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
