"""Exposure and white balance of pictures: what they measure, and what a person should change.

Pure. A picture without anything neutral in it gives no colour cast.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from services.pi_tracker.image.chroma import Cells, cells_of, concatenate
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import Array

# RGB this bright or luma this dark tells nothing more of a colour.
_BRIGHT, _DARK = 250.0, 16.0
# Shares of the picture beyond which that matters: a lamp in view is no reason to darken everything,
# a window is.
_MAX_CLIPPED, _MAX_BLACK = 0.02, 0.5
# Below this median value paint is as dark as its noise; above that one its highlights clip.
_MIN_VALUE, _MAX_VALUE = 55.0, 205.0
# A background is neutral if it is less saturated than this, in a tenth of the picture at least.
_NEUTRAL_SATURATION, _NEUTRAL_SHARE = 100.0, 0.1
# A cast people do not see turns hues by 1; 5 % turns violet by half of its range's width (measured
# on the simulator).
_MAX_CAST = 0.05
# Pictures are encoded with about this gamma, gains act on linear light.
_GAMMA = 2.2
# A finger tip at 1 m/s, half a metre from a lens of f = 527 px, moves 10 px in 10 ms: its own
# width.
_MAX_EXPOSURE_US = 10_000.0


@dataclass(frozen=True)
class ExposureStatistics:
    """What pictures say of exposure and white balance.

    The casts are ratios of linear light to green on what is neutral, less 1 (0.1: a tenth too
    much); None if nothing in the picture is neutral.
    """

    value: float  # median, 0..255
    clipped: float  # share of the picture
    black: float  # share of the picture
    red_cast: float | None
    blue_cast: float | None


def assess(frames: Sequence[Frame]) -> ExposureStatistics:
    """Measure pictures of the background, or of a hand before it."""
    cells = concatenate([cells_of(frame) for frame in frames])
    _, saturation, value = cells.hsv()
    red, green, blue = _rgb(cells)
    neutral = (
        (saturation < _NEUTRAL_SATURATION)
        & (value < _BRIGHT)
        & (cells.y > _DARK)
        & (np.minimum(np.minimum(red, green), blue) > 1.0)
    )
    casts: tuple[float | None, float | None] = (None, None)
    if np.count_nonzero(neutral) >= _NEUTRAL_SHARE * value.size:
        ratios = [
            float(np.median((channel[neutral] / green[neutral]) ** _GAMMA))
            for channel in (red, blue)
        ]
        casts = (round(ratios[0] - 1.0, 3), round(ratios[1] - 1.0, 3))
    clipped = float(np.mean(np.maximum(np.maximum(red, green), blue) >= _BRIGHT))
    return ExposureStatistics(
        round(float(np.median(value)), 1),
        round(clipped, 4),
        round(float(np.mean(cells.y < _DARK)), 4),
        *casts,
    )


def _rgb(cells: Cells) -> tuple[Array, Array, Array]:
    """R, G, B by BT.601, rounded to three digits unlike image/hue.py: thresholds are with these."""
    grey = 255.0 / 219.0 * cells.y
    return grey + 1.596 * cells.v, grey - 0.392 * cells.u - 0.813 * cells.v, grey + 2.017 * cells.u


def advice(
    light: ExposureStatistics,
    exposure_us: float = 0.0,
    red_gain: float = 0.0,
    blue_gain: float = 0.0,
) -> list[str]:
    """What a person should change; empty if the light is good.

    The exposure and the gains are those in use, 0 where unknown.
    """
    found = _brightness_advice(light)
    if light.red_cast is None or light.blue_cast is None:
        found.append(
            "nothing neutral is in the picture, so its white balance cannot be judged; "
            "hold white paper before the camera"
        )
    elif max(abs(light.red_cast), abs(light.blue_cast)) > _MAX_CAST:
        remedy = "run --auto on a white or grey background"
        if min(red_gain, blue_gain) > 0.0:
            red, blue = red_gain / (1.0 + light.red_cast), blue_gain / (1.0 + light.blue_cast)
            remedy = (
                "if the background is white or grey, "
                f"--red-gain {red:.2f} --blue-gain {blue:.2f} mend it"
            )
        found.append(
            f"colour cast of red {100 * light.red_cast:+.0f} %, "
            f"blue {100 * light.blue_cast:+.0f} % against green; {remedy}"
        )
    if exposure_us > _MAX_EXPOSURE_US:
        found.append(
            f"{exposure_us / 1000:.0f} ms of exposure blur fast fingers by their own width; "
            f"stay below {_MAX_EXPOSURE_US / 1000:.0f} ms"
        )
    return found


def _brightness_advice(light: ExposureStatistics) -> list[str]:
    found = []
    if light.clipped > _MAX_CLIPPED:
        found.append(
            f"{100 * light.clipped:.0f} % of the picture is overexposed: shorten --exposure-us, "
            "lower --gain, or move the lamp"
        )
    elif light.value > _MAX_VALUE:
        found.append(
            f"the picture is very bright (median {light.value:.0f} of 255): shorten --exposure-us"
        )
    if light.value < _MIN_VALUE or light.black > _MAX_BLACK:
        found.append(
            f"the picture is dark (median {light.value:.0f} of 255): more light, then more --gain"
        )
    return found
