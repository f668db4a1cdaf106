"""A hand's skin in the scene, with the parts lit that touch something.

Its vertices are computed here and sent with the joints and bones of the same message. A browser
that bent a mesh by bones of its own (viser's skinned meshes) would show them a picture apart: it
moves such bones before it draws, but meshes that are drawn many times, as joints are, only after.
And 50 small messages a hand and picture cost more than one large one. It is translucent, so that
joints and bones tell beneath it how sure each is.
"""

from __future__ import annotations

from collections.abc import Set
from typing import Any

import viser

from rhot.hand import HandName
from services.viewer.live.palette import SKIN, TOUCH
from services.viewer.live.views import HandView
from services.viewer.scene.skin_shape import LitSkin, SkinShape, fit_skin
from services.viewer.scene.spheres import put, reveal

_OPACITY, _LIT_OPACITY = 0.26, 0.6
_PAINT: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False}


class Skin:
    """One hand's skin."""

    def __init__(self, scene: viser.SceneApi, path: str, hand: HandName) -> None:
        self._scene, self._path, self._hand = scene, path, hand
        self._shape: SkinShape | None = None
        self._mesh: viser.MeshHandle | None = None
        self._lit: LitSkin | None = None
        self._lit_mesh: viser.MeshHandle | None = None
        self._lit_parts: Set[str] = frozenset()

    def show(self, view: HandView | None, touching: Set[str]) -> None:
        """Draw it as a pose has it, None hides it; touching are parts of the hand."""
        if view is None:
            for mesh in (self._mesh, self._lit_mesh):
                if mesh is not None:
                    reveal(mesh, False)
            return
        joints = view.positions_m, view.rotations
        if self._shape is None or not self._shape.fits(*joints):
            self._shape, self._lit_parts = fit_skin(self._hand, *joints), frozenset()
        vertices = self._shape.vertices(*joints)
        if self._mesh is None:
            self._mesh = self._scene.add_mesh_simple(
                self._path, vertices, self._shape.faces, color=SKIN, opacity=_OPACITY, **_PAINT
            )
        put(self._mesh, vertices=vertices)
        reveal(self._mesh, True)
        self._light(self._shape, view, touching)

    def _light(self, shape: SkinShape, view: HandView, touching: Set[str]) -> None:
        if touching and touching != self._lit_parts:
            self._lit = shape.lit(touching)
        self._lit_parts = touching
        shown = bool(touching) and self._lit is not None and len(self._lit.faces) > 0
        if shown and self._lit is not None:
            vertices = shape.lit_vertices(self._lit, view.positions_m, view.rotations)
            if self._lit_mesh is None:
                self._lit_mesh = self._scene.add_mesh_simple(
                    f"{self._path}/lit",
                    vertices,
                    self._lit.faces,
                    color=TOUCH,
                    opacity=_LIT_OPACITY,
                    **_PAINT,
                )
            put(self._lit_mesh, vertices=vertices, faces=self._lit.faces)
        if self._lit_mesh is not None:
            reveal(self._lit_mesh, shown)
