"""How much of each painted landmark a camera really sees: the yardstick for recall and for the bias
of centroids. Pure.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from services.simulator.render.renderer import Renderer


class Sight(NamedTuple):
    """One landmark in one picture, by the middles of pixels, each row at its own mid-exposure.

    seen_px are pixels whose middle shows its paint; whole_px are those that would if nothing but
    its own bone were there. centre_px is the mean (x, y) of what is seen, NaN if nothing is.
    """

    seen_px: int
    whole_px: int
    centre_px: tuple[float, float]

    @property
    def share(self) -> float:
        """Seen share of the patch, 0..1.

        0 for a patch that faces away or lies outside the picture.
        """
        return self.seen_px / self.whole_px if self.whole_px else 0.0


def sights(renderer: Renderer, time_s: float) -> dict[tuple[str, str], Sight]:
    """(hand, landmark) -> Sight in the picture whose row 0 is exposed about time_s."""
    labels = renderer.labels(time_s)
    shapes = renderer.cast.shapes
    result = {}
    for mark, surface in renderer.cast.marks.items():
        rows, columns = np.nonzero(labels == 1 + surface)
        centre = (
            (float(columns.mean()), float(rows.mean()))
            if len(rows)
            else (float("nan"), float("nan"))
        )
        dabs = shapes.dab_frame[shapes.dab_surface == surface]
        own = (shapes.kind[:, 1] == surface) | np.isin(shapes.frame[:, 0], dabs)
        whole = int(np.count_nonzero(renderer.labels(time_s, only=own) == 1 + surface))
        result[mark] = Sight(len(rows), whole, centre)
    return result
