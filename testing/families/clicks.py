"""Colour ranges as somebody has them who clicks on the paint in a room's pictures."""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import Colors
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.frame import Frame
from services.simulator.camera.frame_source import FrameSource
from services.simulator.camera.visibility import patch_visibility
from testing.families.pictures import PaintMiddles, Recipe, frame_of
from testing.synthetic_points import START_NS

# Another seed of a room has the same lamps and paint, but other noise: somebody calibrated before.
_CALIBRATED = 1_000_000
# Of so many pictures, at even distances; paint of which less shows is not clicked on.
_PICTURES, _VISIBLE = 5, 0.6


def clicked_colors(recipe: Recipe, camera: str) -> Colors:
    """Ranges fitted to clicks on the middles of the paint, in five pictures that were taken before.

    Raises CalibrationError if a colour has no click that shows it.
    """
    scene, hand = recipe.scene(seed=recipe.seed + _CALIBRATED), recipe.hand()
    landmarks = scene.hands[hand.hand].landmarks
    middles = PaintMiddles(scene, hand, tuple(landmarks))
    source = FrameSource(scene, camera, recorded=True)
    count = int(recipe.seconds * scene.config.camera_named(camera).fps)
    frames: list[Frame] = []
    pointers: list[Pointer] = []
    for seq in np.linspace(0, count - 1, _PICTURES).astype(int).tolist():
        taken = source.take(seq, START_NS)
        if taken.image is None:
            continue
        patches = patch_visibility(source.renderer, taken.time_s)
        places_px = scene.cameras[camera].project(middles(np.array([taken.time_s]))[0])
        pointers += [
            Pointer(color, len(frames), float(x_px), float(y_px))
            for (landmark, color), (x_px, y_px) in zip(landmarks.items(), places_px, strict=True)
            if patches[hand.hand, landmark].share >= _VISIBLE
        ]
        frames.append(frame_of(taken))
    return Colors(tool="testing/families", colors=fit(gather(frames, pointers).samples))
