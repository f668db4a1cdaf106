"""The noise estimate against the noise that was put in."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.image.noise import Noise
from services.pi_tracker.image.yuv_planes import picture


@pytest.mark.parametrize("sigma", [1.0, 3.0, 6.0])
def test_noise_of_a_wall_with_things_on_it(studio, tip, sigma):
    tips = [tip(name, 60.0 + 80 * i, 60.0, 30.0, 40.0) for i, name in enumerate(studio.paints)]
    frame, _ = studio.frame(tips, sigma=sigma, size_px=(560, 120))
    noise = Noise()
    noise.update(picture(frame))
    plain = picture(studio.of(studio.bgr(np.full((120, 560, 3), 140.0), sigma, 1)))
    luma, chroma = plain.cells((0, 0, 280, 60))
    assert noise.luma == pytest.approx(luma.std(), rel=0.4, abs=0.3)
    assert noise.chroma == pytest.approx(chroma.std(axis=(0, 1)).mean(), rel=0.4, abs=0.3)


def test_a_flat_and_a_tiny_picture_have_the_noise_of_rounding(studio):
    for size in ((64, 64), (2, 2)):
        noise = Noise()
        noise.update(picture(studio.of(np.full((size[1], size[0], 3), 90, np.uint8))))
        assert 0.0 < noise.luma < 0.5
        assert 0.0 < noise.chroma < 0.5
