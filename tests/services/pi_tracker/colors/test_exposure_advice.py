"""What pictures say of exposure and white balance, and the advice that follows."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.colors.exposure_advice import ExposureStatistics, advice, assess

GOOD = ExposureStatistics(value=140.0, clipped=0.0, black=0.0, red_cast=0.01, blue_cast=-0.02)


@pytest.mark.parametrize("layout", ["i420", "bgr"])
def test_a_good_picture_needs_no_advice(studio, tip, layout):
    frame, _ = studio.frame([tip("green", 50.0, 60.0)], size_px=(160, 120), layout=layout)
    light = assess([frame])
    assert abs(light.red_cast) < 0.05
    assert abs(light.blue_cast) < 0.05
    assert advice(light, 8000.0, 1.6, 1.4) == []


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        ((254, 254, 254), "overexposed"),
        ((228, 228, 228), "very bright"),
        ((22, 22, 22), "dark"),
        ((150, 152, 168), "colour cast of red"),
        ((40, 180, 40), "nothing neutral"),
    ],
)
def test_what_is_wrong_with_the_light_is_said(studio, wall, words):
    clean, _ = studio.clean([], (160, 120), wall=wall)
    found = advice(assess([studio.of(studio.bgr(clean, 2.0, 1))]))
    assert any(words in line for line in found), found


def test_the_advised_gains_make_the_wall_grey(studio):
    clean, _ = studio.clean([], (160, 120), wall=(130, 150, 168))
    light = assess([studio.of(studio.bgr(clean, 2.0, 1))])
    (line,) = advice(light, 0.0, 1.5, 1.5)
    red, blue = (
        float(word)
        for word in line.replace("--red-gain ", "|")
        .replace(" --blue-gain ", "|")
        .replace(" mend", "|")
        .split("|")[1:3]
    )
    # A gain acts on linear light, of which pictures show the 1 / 2.2th power.
    mended = np.array([130 * (blue / 1.5) ** (1 / 2.2), 150, 168 * (red / 1.5) ** (1 / 2.2)])
    assert np.ptp(mended) < 2.5


def test_slow_exposures_are_warned_of():
    assert any("blur" in line for line in advice(GOOD, exposure_us=20_000.0))
    assert advice(GOOD, exposure_us=8000.0) == []
