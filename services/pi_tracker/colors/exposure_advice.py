"""Light: whether a camera's automatics have settled, and what a picture says of exposure and white
balance. Pure.

The automatics run once, on the background the camera will see, and are then frozen: ranges are
worth nothing while the camera changes its mind. A driver that reports nothing never settles; the
caller has a deadline. A picture without anything neutral in it gives no cast.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot.files.calibration import Exposure
from services.pi_tracker.image.chroma import Cells, cells_of, joined
from services.pi_tracker.image.frame import Frame

# Automatics count as settled when nothing has changed by more than this for so long; picamera2's
# take one to two seconds to get there.
_STILL, _STILL_NS = 0.02, 1_000_000_000
# Fewer reports are no second of a camera.
_LEAST_REPORTS = 5
# RGB this bright or luma this dark tells nothing more of a colour.
_BRIGHT, _DARK = 250.0, 16.0
# Shares of the picture beyond which that matters: a lamp in view is no reason to darken everything,
# a window is.
_MUCH_BRIGHT, _MUCH_DARK = 0.02, 0.5
# Below this median value paint is as dark as its noise; above that one its highlights clip.
_DIM, _GLARING = 55.0, 205.0
# A background is neutral if it is less saturated than this, in a tenth of the picture at least.
_NEUTRAL_SATURATION, _NEUTRAL_SHARE = 100.0, 0.1
# A cast people do not see turns hues by 1; 5 % turns violet by half of its range's width (measured
# on the simulator).
_CAST = 0.05
# Pictures are encoded with about this gamma, gains act on linear light.
_GAMMA = 2.2
# A finger tip at 1 m/s, half a metre from a lens of f = 527 px, moves 10 px in 10 ms: its own
# width.
_SLOW_US = 10_000.0


class Settling:
    """Reports of a running automatic, one per image."""

    def __init__(self) -> None:
        self._reports: deque[tuple[int, Exposure]] = deque(maxlen=1024)

    def add(self, report: Exposure, stamp_ns: int) -> None:
        """What an image was taken with."""
        self._reports.append((stamp_ns, report))
        while (
            stamp_ns - self._reports[0][0] > _STILL_NS
            and stamp_ns - self._reports[1][0] >= _STILL_NS
        ):
            self._reports.popleft()

    def settled(self) -> Exposure | None:
        """The values, once they have not changed for a second."""
        if (
            len(self._reports) < _LEAST_REPORTS
            or self._reports[-1][0] - self._reports[0][0] < _STILL_NS
        ):
            return None
        values = np.array(
            [[r.exposure_us, r.gain, r.red_gain, r.blue_gain] for _, r in self._reports]
        )
        if np.any(np.ptp(values, axis=0) > _STILL * np.maximum(np.abs(values).max(axis=0), 1e-9)):
            return None
        exposure_us, gain, red_gain, blue_gain = np.median(values, axis=0).tolist()
        return Exposure(
            exposure_us=round(exposure_us, 1),
            gain=round(gain, 4),
            red_gain=round(red_gain, 4),
            blue_gain=round(blue_gain, 4),
        )


@dataclass(frozen=True)
class Light:
    """What pictures say: median value (0..255), shares that are clipped and black, red and blue
    light against green on what is neutral.

    The casts are ratios of linear light less 1 (0.1: a tenth too much), None if nothing in the
    picture is neutral.
    """

    value: float
    clipped: float
    black: float
    red_cast: float | None
    blue_cast: float | None


def assess(frames: Sequence[Frame]) -> Light:
    """Measure pictures of the background, or of a hand before it."""
    cells = joined([cells_of(frame) for frame in frames])
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
    return Light(
        round(float(np.median(value)), 1),
        round(clipped, 4),
        round(float(np.mean(cells.y < _DARK)), 4),
        *casts,
    )


def _rgb(cells: Cells) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    grey = 255.0 / 219.0 * cells.y
    return grey + 1.596 * cells.v, grey - 0.392 * cells.u - 0.813 * cells.v, grey + 2.017 * cells.u


def advice(
    light: Light, exposure_us: float = 0.0, red_gain: float = 0.0, blue_gain: float = 0.0
) -> list[str]:
    """What a person should change; empty if the light is good.

    The numbers are in force, 0 where unknown.
    """
    found = []
    if light.clipped > _MUCH_BRIGHT:
        found.append(
            f"{100 * light.clipped:.0f} % of the picture is overexposed: shorten --exposure-us, lower --gain, or move the lamp"
        )
    elif light.value > _GLARING:
        found.append(
            f"the picture is very bright (median {light.value:.0f} of 255): shorten --exposure-us"
        )
    if light.value < _DIM or light.black > _MUCH_DARK:
        found.append(
            f"the picture is dark (median {light.value:.0f} of 255): more light, then more --gain"
        )
    if light.red_cast is None or light.blue_cast is None:
        found.append(
            "nothing neutral is in the picture, so its white balance cannot be judged; hold white paper before the camera"
        )
    elif max(abs(light.red_cast), abs(light.blue_cast)) > _CAST:
        cast = f"colour cast of red {100 * light.red_cast:+.0f} %, blue {100 * light.blue_cast:+.0f} % against green"
        better = "run --auto on a white or grey background"
        if min(red_gain, blue_gain) > 0.0:
            red, blue = red_gain / (1.0 + light.red_cast), blue_gain / (1.0 + light.blue_cast)
            better = f"if the background is white or grey, --red-gain {red:.2f} --blue-gain {blue:.2f} mend it"
        found.append(f"{cast}; {better}")
    if exposure_us > _SLOW_US:
        found.append(
            f"{exposure_us / 1000:.0f} ms of exposure blur fast fingers by their own width; stay below {_SLOW_US / 1000:.0f} ms"
        )
    return found
