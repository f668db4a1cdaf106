"""The 3D scene of the live view: draws a View with viser.

Meshes are made once and then moved; a hand, point or object that is gone is hidden. Without
calibration there are no frusta.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, apply, quaternion_from_rotation
from rhot.hand import HandName
from services.viewer.live.model import HandView, PointView, View
from services.viewer.live.object_looks import ObjectLook
from services.viewer.live.objects import Objects
from services.viewer.live.palette import SOURCE_RGB, UNKNOWN, Rgb
from services.viewer.live.shapes import BONES, cylinders, f32, unit_cylinder, unit_sphere
from services.viewer.live.touches import Touches

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
# Joints at their full skin radius would hide the bones; with these shares of it, both are seen.
_JOINT_SHARE, _BONE_SHARE = 0.72, 0.42
_POINT_RADIUS_M, _PREDICTED_RADIUS_M, _HIDDEN_RADIUS_M = 0.008, 0.004, 1e-6
# Each visitor shows or hides what is under it (services/viewer/visits/layer.py).
TRAILS = "/trails"
_TRAIL_RGB: Rgb = (90, 90, 90)
# Sources from most to least certain: a bone is as certain as its worse end.
_SOURCES = tuple(SOURCE_RGB)
_PALETTE = np.array([SOURCE_RGB[source] for source in _SOURCES], dtype=np.uint8)


class LiveScene:
    """Everything that is drawn; paints is what each hand's landmarks are painted with, looks how
    each object looks.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        config: RigConfig,
        cameras: Mapping[str, Camera],
        paints: Mapping[tuple[HandName, str], Rgb],
        looks: Mapping[str, ObjectLook],
    ) -> None:
        self._scene = server.scene
        self._atomic = server.atomic
        self._paints = paints
        self._hands: dict[HandName, _Hand] = {}
        self._points: dict[HandName, _Points] = {}
        self._objects = Objects(server.scene, looks)
        self._touches = Touches(server.scene)
        self._add_grid(server, config)
        for camera in cameras.values():
            self._add_frustum(camera)

    def show(self, view: View, *, trails: bool) -> None:
        """Bring the picture up to date."""
        with self._atomic():
            for hand in {*self._hands, *view.hands}:
                self._show_hand(hand, view, trails=trails)
            for hand in {*self._points, *(name for name, _ in view.points)}:
                self._show_points(hand, view)
            self._objects.show(view.objects)
            self._touches.show(view)

    def _show_hand(self, hand: HandName, view: View, *, trails: bool) -> None:
        if hand not in self._hands:
            self._hands[hand] = _Hand(self._scene, hand)
        trail = view.trails.get(hand) if trails else None
        self._hands[hand].show(view.hands.get(hand), trail)

    def _show_points(self, hand: HandName, view: View) -> None:
        if hand not in self._points:
            paints = {name: rgb for (of_hand, name), rgb in self._paints.items() if of_hand == hand}
            self._points[hand] = _Points(self._scene, hand, paints)
        self._points[hand].show(
            {name: point for (of_hand, name), point in view.points.items() if of_hand == hand}
        )

    def _add_grid(self, server: viser.ViserServer, config: RigConfig) -> None:
        """Up direction, grid and first viewpoint.

        y is down in a camera's frame; a world frame has z up and its desk at z = 0.
        """
        world = config.rig.world
        T_rig_from_camera = np.eye(4) if world is None else np.array(world.T_rig_from_camera)
        self._scene.set_up_direction("-y" if world is None else "+z")
        # viser's default lighting washes out the colours, which have a meaning here.
        self._scene.configure_environment_map(environment_intensity=0.35)
        self._scene.add_grid(
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
        self._scene.add_frame("/rig", axes_length=0.04, axes_radius=0.0012)
        server.initial_camera.position = apply(T_rig_from_camera, _VIEWPOINT_CAMERA)
        server.initial_camera.look_at = apply(T_rig_from_camera, _LOOK_AT_CAMERA)
        server.initial_camera.fov = _FOV_RAD

    def _add_frustum(self, camera: Camera) -> None:
        width, height = camera.size_px
        self._scene.add_camera_frustum(
            f"/cameras/{camera.name}",
            fov=float(2.0 * np.arctan2(height / 2.0, camera.focal_px[1])),
            aspect=width / height,
            scale=0.035,
            thickness=0.0006,
            color=(60, 60, 60),
            wxyz=quaternion_from_rotation(camera.T_rig_from_camera[:3, :3]),
            position=camera.centre_rig,
        )
        self._scene.add_label(f"/cameras/{camera.name}/name", camera.name)


class _Hand:
    """A hand: joints as spheres, bones as tubes, and the trails of the finger tips."""

    def __init__(self, scene: viser.SceneApi, hand: HandName) -> None:
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (26, 1))
        mesh, tube = unit_sphere(), unit_cylinder()
        self._joints = scene.add_batched_meshes_simple(
            f"/hands/{hand}/joints",
            *mesh,
            turns,
            np.zeros((26, 3)),
            batched_scales=np.full((26, 3), 0.01),
            batched_colors=_PALETTE[np.ones(26, dtype=int)],
            lod="off",
        )
        self._bones = scene.add_batched_meshes_simple(
            f"/hands/{hand}/bones",
            *tube,
            np.tile([1.0, 0.0, 0.0, 0.0], (len(BONES), 1)),
            np.zeros((len(BONES), 3)),
            batched_scales=np.full((len(BONES), 3), 0.01),
            batched_colors=_PALETTE[np.ones(len(BONES), dtype=int)],
            lod="off",
        )
        self._trails = scene.add_line_segments(
            f"{TRAILS}/{hand}", np.zeros((1, 2, 3)), _TRAIL_RGB, thickness=0.001, visible=False
        )

    def show(self, view: HandView | None, trail: Array | None) -> None:
        self._joints.visible = self._bones.visible = view is not None
        self._trails.visible = view is not None and trail is not None and len(trail) > 1
        if view is None:
            return
        uncertainty = np.array([_SOURCES.index(source) for source in view.sources])
        self._joints.batched_positions = f32(view.positions_m)
        self._joints.batched_scales = f32(
            np.repeat(_JOINT_SHARE * view.radii_m[:, None], 3, axis=1)
        )
        self._joints.batched_colors = _PALETTE[uncertainty]
        start, end = BONES.T
        middle, wxyz, length = cylinders(view.positions_m[start], view.positions_m[end])
        radius = _BONE_SHARE * np.minimum(view.radii_m[start], view.radii_m[end])
        self._bones.batched_positions = f32(middle)
        self._bones.batched_wxyzs = f32(wxyz)
        self._bones.batched_scales = f32(np.stack([radius, radius, length], axis=1))
        self._bones.batched_colors = _PALETTE[np.maximum(uncertainty[start], uncertainty[end])]
        if self._trails.visible and trail is not None:
            self._trails.points = f32(np.stack([trail[:-1], trail[1:]], axis=2).reshape(-1, 2, 3))


class _Points:
    """Painted landmarks in the colour of their paint; predicted ones are smaller."""

    def __init__(self, scene: viser.SceneApi, hand: HandName, paints: Mapping[str, Rgb]) -> None:
        self._names = list(paints)
        count = max(len(paints), 1)
        self._handle = scene.add_batched_meshes_simple(
            f"/hands/{hand}/points",
            *unit_sphere(),
            np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            np.zeros((count, 3)),
            batched_scales=np.full((count, 3), _HIDDEN_RADIUS_M),
            batched_colors=np.array(list(paints.values()) or [UNKNOWN], dtype=np.uint8),
            lod="off",
        )

    def show(self, points: Mapping[str, PointView]) -> None:
        self._handle.visible = bool(points)
        # viser wants at least one; those that are not there are too small to be seen.
        count = max(len(self._names), 1)
        positions, radii = np.zeros((count, 3)), np.full(count, _HIDDEN_RADIUS_M)
        for slot, name in enumerate(self._names):
            if name in points:
                positions[slot] = points[name].position_m
                radii[slot] = _PREDICTED_RADIUS_M if points[name].predicted else _POINT_RADIUS_M
        self._handle.batched_positions = f32(positions)
        self._handle.batched_scales = f32(np.repeat(radii[:, None], 3, axis=1))
