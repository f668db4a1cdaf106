"""How much of each painted patch is visible in a picture: ground truth for the recall of detection
and for the bias of centroids. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from services.simulator.render.renderer import Renderer


class PatchVisibility(NamedTuple):
    """One painted landmark in one picture, each row at its own mid-exposure.

    visible_px counts the pixels whose middle shows its paint, whole_px those that would if only the
    capsules of its own bone were there. centre_px is the mean (x, y) of the visible ones, NaN if
    there are none.
    """

    visible_px: int
    whole_px: int
    centre_px: tuple[float, float]

    @property
    def share(self) -> float:
        """Visible share of the patch, 0..1.

        0 for a patch that faces away or lies outside the picture.
        """
        return self.visible_px / self.whole_px if self.whole_px else 0.0


def patch_visibility(renderer: Renderer, time_s: float) -> dict[tuple[str, str], PatchVisibility]:
    """Every (hand, landmark) in the picture whose row 0 is exposed about time_s."""
    labels = renderer.labels(time_s)
    shapes = renderer.shapes.arrays
    result = {}
    for landmark, surface in renderer.shapes.paint_surfaces.items():
        rows, columns = np.nonzero(labels == 1 + surface)
        centre = (float("nan"), float("nan"))
        if len(rows):
            centre = (float(columns.mean()), float(rows.mean()))
        dab_frames = shapes.dab_frame[shapes.dab_surface == surface]
        own = (shapes.kind[:, 1] == surface) | np.isin(shapes.frame[:, 0], dab_frames)
        whole = int(np.count_nonzero(renderer.labels(time_s, only=own) == 1 + surface))
        result[landmark] = PatchVisibility(len(rows), whole, centre)
    return result
