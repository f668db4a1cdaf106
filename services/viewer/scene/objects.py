"""Objects in the scene: each in its shape, with axes, its tracker and its name.

Without a shape in rig.toml, or with a mesh that cannot be read, the axes and the name are all there
is. What is not certain is orange and faint, what is touched is lit; what is lost or not registered
is hidden.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import viser

from rhot.files.calibration import ObjectPlace
from rhot.geometry.transforms import (
    inverse,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_x,
    transform,
)
from services.viewer.live.object_texts import label
from services.viewer.live.palette import SOURCE_RGB, TOUCHED, TRACKER
from services.viewer.live.views import ObjectView
from services.viewer.scene.object_looks import ObjectLook
from services.viewer.scene.spheres import reveal

# Fingers behind an object, and contacts on its far side, stay in sight.
_OPACITY, _FAINT = 0.55, 0.2
# Which way it is turned, seen at a second look.
_AXES_M, _AXES_RADIUS_M = 0.03, 0.0008
# Radius and height of the disc that stands for a tracker: half as large as one (71 x 79 x 44 mm),
# which would hide a cup and the hand at it.
_PUCK_M = (0.019, 0.022)


_NO_LOOK = ObjectLook()


class Objects:
    """All objects of the scene."""

    def __init__(self, scene: viser.SceneApi, looks: Mapping[str, ObjectLook]) -> None:
        self._scene = scene
        self._looks = looks
        self._objects: dict[str, _Object] = {}

    def show(self, views: Mapping[str, ObjectView], touched: Collection[str]) -> None:
        """Move, colour, and hide what is gone; touched are the names of those that are touched."""
        for name in {*self._objects, *views}:
            if name not in self._objects:
                look = self._looks.get(name, _NO_LOOK)
                self._objects[name] = _Object(self._scene, name, look)
            self._objects[name].show(views.get(name), name in touched)


class _Object:
    """One object: everything hangs on the frame of its axes."""

    def __init__(self, scene: viser.SceneApi, name: str, look: ObjectLook) -> None:
        path = f"/objects/{name}"
        self._frame = scene.add_frame(path, axes_length=_AXES_M, axes_radius=_AXES_RADIUS_M)
        self._body: Any = _body(scene, f"{path}/shape", look)
        if look.place is not None:
            _puck(scene, f"{path}/tracker", look.place)
        # Above the object, not across it: y is down in a camera's frame.
        self._label = scene.add_label(f"{path}/name", name, anchor="bottom-center")
        self._looks: tuple[str, bool, bool] | None = None

    def show(self, view: ObjectView | None, touched: bool) -> None:
        reveal(self._frame, view is not None and view.drawn)
        if view is None or not view.drawn:
            return
        self._frame.position = view.position_m
        self._frame.wxyz = view.orientation_wxyz
        # Found out here, which viser takes longer for.
        looks = (label(view), view.certain, touched)
        if looks == self._looks:
            return
        self._looks = looks
        self._label.text = label(view)
        if self._body is not None:
            source = SOURCE_RGB["measured" if view.certain else "predicted"]
            self._body.color = TOUCHED if touched else source
            self._body.opacity = _OPACITY if view.certain else _FAINT


def _body(scene: viser.SceneApi, path: str, look: ObjectLook) -> Any:
    """The object's surface, or None where rig.toml says none."""
    paint: dict[str, Any] = {
        "color": SOURCE_RGB["measured"],
        "opacity": _OPACITY,
        "side": "double",
        "cast_shadow": False,
        "receive_shadow": False,
    }
    if look.mesh is not None:
        return scene.add_mesh_simple(path, *look.mesh, flat_shading=True, **paint)
    size = () if look.table is None else look.table.size_m
    match "" if look.table is None else look.table.shape:
        case "box":
            return scene.add_box(path, dimensions=size, **paint)  # type: ignore[arg-type]
        case "cylinder":
            # viser's stand along z, rig.toml's along y.
            wxyz = quaternion_from_rotation(rotation_x(-np.pi / 2.0))
            return scene.add_cylinder(path, 0.5 * size[0], size[1], wxyz=wxyz, **paint)
        case "sphere":
            return scene.add_icosphere(path, 0.5 * size[0], **paint)
    return None


def _puck(scene: viser.SceneApi, path: str, place: ObjectPlace) -> None:
    """The tracker, where calibration/objects.json has it on the object."""
    T_tracker_from_object = transform(
        rotation_from_quaternion(place.orientation_wxyz), place.offset_m
    )
    T_object_from_tracker = inverse(T_tracker_from_object)
    radius, height = _PUCK_M
    scene.add_cylinder(
        path,
        radius,
        height,
        color=TRACKER,
        opacity=0.6,
        cast_shadow=False,
        receive_shadow=False,
        wxyz=quaternion_from_rotation(T_object_from_tracker[:3, :3]),
        position=T_object_from_tracker[:3, 3],
    )
