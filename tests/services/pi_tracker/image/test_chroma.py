"""Which colours are skin's."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.image.chroma import Cells, skin_mask

# Luma (from 16 on) and chroma (from 128 on) of skin in white, warm and dim light; of magenta paint
# on a thumb in warm light, lit and in its own shade; grey.
SKIN = [(120.0, -18.0, 22.0), (90.0, -22.0, 30.0), (46.0, -8.0, 12.0)]
OTHERS = [(72.0, -5.0, 51.0), (34.0, -2.0, 29.0), (32.0, -2.0, 24.0), (90.0, -2.0, 6.0)]


@pytest.mark.parametrize(("colors", "is_skin"), [(SKIN, True), (OTHERS, False)])
def test_skin_is_told_from_dark_paint(colors, is_skin):
    cells = Cells(*np.array(colors).T)
    assert skin_mask(cells).tolist() == [is_skin] * len(colors)
