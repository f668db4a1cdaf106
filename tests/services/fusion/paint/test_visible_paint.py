"""How deep under its top two cameras locate a dab of paint on curved skin."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.paint.visible_paint import dab_sag_m


def located_depth_m(normals, weights, places):
    """How deep below the top two cameras 9 degrees apart locate skin.

    Each by the middle of what it sees, weighted by how the skin faces it.
    """
    shifts = []
    for angle in (-0.08, 0.08):
        facing = weights * (normals @ [np.sin(angle), 0.0, np.cos(angle)])
        shifts.append(np.average(places @ [np.cos(angle), 0.0, -np.sin(angle)], weights=facing))
    return 0.021 - (shifts[0] - shifts[1]) / (2.0 * np.sin(0.08))


def test_two_cameras_locate_a_dab_at_its_rim():
    """Against points spread over the cap of a ball, and over a cylinder.

    A dab on nothing lies where it is seen.
    """
    side = np.linspace(-0.008, 0.008, 801)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    inside = x**2 + y**2 < 0.008**2
    x, y = x[inside], y[inside]
    ball = np.column_stack([x, y, np.sqrt(0.021**2 - x**2 - y**2)])
    # As seen from above, a patch of skin is larger than it looks by 1 / cosine.
    deep_m = located_depth_m(ball / 0.021, 0.021 / ball[:, 2], ball)
    assert dab_sag_m(0.008, 0.021) == pytest.approx(deep_m, rel=0.01)
    roll = np.column_stack([x, y, np.sqrt(0.021**2 - x**2)])
    deep_m = located_depth_m(roll * [1.0, 0.0, 1.0] / 0.021, 0.021 / roll[:, 2], roll)
    assert 0.75 * dab_sag_m(0.008, 0.021) == pytest.approx(deep_m, rel=0.03)
    assert dab_sag_m(0.008, 0.0) == 0.0
