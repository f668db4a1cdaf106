"""Every body of a scene as capsules, dabs of paint and surfaces, for the renderer. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from services.simulator.hands.bodies import HAND_FRAMES, ShapeArrays, ShapeBuilder, add_hand
from services.simulator.scene.paints import CUP, SKIN, TRACKER, Surface, paint
from services.simulator.scene.scene import Scene

# An object is an upright cylinder about its y axis, half this long and this thick; its tracker is a
# flat disc across.
_HALF_LENGTH_M, _RADIUS_M = 0.055, 0.018
_TRACKER_HALF_M, _TRACKER_RADIUS_M = 0.012, 0.024


@dataclass(frozen=True, eq=False)
class SceneShapes:
    """Every body of a scene and how it looks.

    paint_surfaces: (hand, landmark) -> number of the surface that is its paint.
    """

    arrays: ShapeArrays
    surfaces: list[Surface]
    paint_surfaces: dict[tuple[str, str], int]


def scene_shapes(scene: Scene) -> SceneShapes:
    """Bodies and surfaces of a scene; surface 0 is skin.

    Raises ConfigError for a colour no paint has.
    """
    shapes, surfaces = ShapeBuilder(), [SKIN, CUP, TRACKER]
    paint_surfaces: dict[tuple[str, str], int] = {}
    for number, hand in enumerate(scene.hands.values()):
        paints: dict[str, int] = {}
        for landmark, color in hand.landmarks.items():
            paints[landmark] = paint_surfaces[hand.name, landmark] = len(surfaces)
            surfaces.append(paint(color))
        add_hand(shapes, hand.model, number * HAND_FRAMES, 0, paints)
    first = HAND_FRAMES * len(scene.hands)
    for number, item in enumerate(scene.objects):
        frame = first + number
        shapes.capsule(
            (frame, (0.0, -_HALF_LENGTH_M, 0.0), _RADIUS_M),
            (frame, (0.0, _HALF_LENGTH_M, 0.0), _RADIUS_M),
            surface=1,
        )
        x, y, z = item.T_object_from_tracker[:3, 3].tolist()
        shapes.capsule(
            (frame, (x - _TRACKER_HALF_M, y, z), _TRACKER_RADIUS_M),
            (frame, (x + _TRACKER_HALF_M, y, z), _TRACKER_RADIUS_M),
            surface=2,
        )
    return SceneShapes(shapes.arrays(), surfaces, paint_surfaces)
