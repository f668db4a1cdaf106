"""Every body of a scene as capsules, solids, dabs of paint and surfaces, for the renderer. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.hand import TIPS, HandModel
from services.simulator.hands.bodies import (
    HAND_FRAMES,
    ShapeArrays,
    ShapeBuilder,
    Vec3,
    add_hand,
)
from services.simulator.scene.object_bodies import (
    MeshBuilder,
    Meshes,
    ObjectSurfaces,
    add_object,
)
from services.simulator.scene.paints import CUP, SKIN, TRACKER, Surface, paint
from services.simulator.scene.scene import Scene

# Numbers of the surfaces that every scene has; paints come after them.
_CUP, _TRACKER = 1, 2


@dataclass(frozen=True, eq=False)
class SceneShapes:
    """Every body of a scene and how it looks.

    paint_surfaces: (hand, landmark) -> number of the surface that is its paint; marker_surfaces:
    object -> that of the paint on its tracker.
    """

    arrays: ShapeArrays
    meshes: Meshes
    surfaces: list[Surface]
    paint_surfaces: dict[tuple[str, str], int]
    marker_surfaces: dict[str, int]


def scene_shapes(scene: Scene) -> SceneShapes:
    """Bodies and surfaces of a scene; surface 0 is skin.

    Raises ConfigError for a colour no paint has.
    """
    skin = SKIN._replace(albedo=scene.spec.skin)
    shapes, meshes, surfaces = ShapeBuilder(), MeshBuilder(), [skin, CUP, TRACKER]
    paint_surfaces: dict[tuple[str, str], int] = {}
    for number, hand in enumerate(scene.hands.values()):
        paints: dict[str, int] = {}
        for landmark, color in hand.landmarks.items():
            paints[landmark] = paint_surfaces[hand.name, landmark] = len(surfaces)
            surfaces.append(paint(color))
        leans_m = _leans_m(hand.model, scene.spec.uneven, (scene.seed, number))
        add_hand(shapes, hand.model, number * HAND_FRAMES, 0, paints, leans_m)
    marker_surfaces: dict[str, int] = {}
    for frame, item in enumerate(scene.objects, start=HAND_FRAMES * len(scene.hands)):
        if item.table.marker:
            marker_surfaces[item.name] = len(surfaces)
            surfaces.append(paint(item.table.marker))
        bead = marker_surfaces.get(item.name, -1)
        add_object(shapes, meshes, item, frame, ObjectSurfaces(_CUP, _TRACKER, bead))
    return SceneShapes(shapes.arrays(), meshes.meshes(), surfaces, paint_surfaces, marker_surfaces)


def _leans_m(model: HandModel, uneven: float, seeds: tuple[int, int]) -> dict[str, Vec3]:
    """How the paint of each tip leans: on the palm's side, on the right, on both alike; m."""
    if not uneven:
        return {}
    rng = np.random.default_rng([*seeds, 61])
    shares = uneven * rng.uniform(-1.0, 1.0, (len(TIPS), 3)) * (0.6, 0.6, 0.4)
    return {
        name: (float(palm), float(right), float(both))
        for name, (palm, right, both) in zip(
            TIPS,
            (shares[n] * model.paint[name].extent_m for n, name in enumerate(TIPS)),
            strict=True,
        )
    }
