"""Automatics that settle, and what pictures say of the light."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.calibration import Exposure
from services.pi_tracker.colors.exposure_advice import Light, Settling, advice, assess

FRAME_NS = 33_333_333
GOOD = Light(value=140.0, clipped=0.0, black=0.0, red_cast=0.01, blue_cast=-0.02)


def report(exposure_us=8000.0, gain=2.0, red=1.6, blue=1.4):
    return Exposure(exposure_us=exposure_us, gain=gain, red_gain=red, blue_gain=blue)


def test_automatics_settle_a_second_after_their_last_change():
    settling = Settling()
    settled_at = None
    for number in range(120):
        settling.add(
            report(
                exposure_us=max(8000.0, 20_000.0 - 400.0 * number), red=1.6 + 0.001 * (number % 3)
            ),
            number * FRAME_NS,
        )
        if settled_at is None and settling.settled() is not None:
            settled_at = number
    # 8000 us are reached in frame 30.
    assert 58 <= settled_at <= 62
    found = settling.settled()
    assert found.exposure_us == 8000.0
    assert found.red_gain == pytest.approx(1.601, abs=1e-3)


def test_automatics_that_hunt_never_settle():
    settling = Settling()
    for number in range(300):
        settling.add(report(gain=2.0 + 0.2 * (number // 10 % 2)), number * FRAME_NS)
        assert settling.settled() is None


def test_few_reports_are_not_enough():
    settling = Settling()
    assert settling.settled() is None
    for number in range(3):
        settling.add(report(), number * 600_000_000)
    assert settling.settled() is None


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
