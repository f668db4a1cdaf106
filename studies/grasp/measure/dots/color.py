"""What the dots look like, from the places where a person clicked on them. Pure.

Coloured paint gives a range of hue, saturation and value, fitted against everything else in the
first picture (services/pi_tracker/colors). Dots of ink, as the paper's black ones, have none.
"""

from __future__ import annotations

import contextlib
import re

import numpy as np

from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import ColorRange
from services.pi_tracker.colors.bounds import bounds, hues_of
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.paint_patch import PaintPatch, find_patch
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.chroma import Cells, cells_of
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.hue import hue_difference
from studies.grasp.measure.seeds import Seeds

DOTS = "dots"
# Dots of one paint differ less in hue between light and shade: as services/pi_tracker/colors/fit.py
# has it.
_SAME_HUE = 12.0
# Dots of one hand are about of one size: a patch so many times larger than the median holds skin,
# too (red paint on dark skin: 5.9 times).
_MUCH_LARGER = 2.5
# Under a click, cells of 2 px to this distance are looked at; dots end within this share of the
# picture's width.
_SAMPLED_CELLS, _RIM_SHARE = 2.5, 0.02
# A range is widened to a paler dot's own saturation and value less this: the next picture's noise.
_WIDER = 8
_RANGE = re.compile(r"(\d+),(\d+),(\d+)-(\d+),(\d+),(\d+)")


def parse_range(text: str) -> ColorRange:
    """A range of the command line: 100,80,40-125,255,255."""
    found = _RANGE.fullmatch(text.replace(" ", ""))
    if not found:
        raise CaptureError(
            f"--hsv {text}: is not low-high of hue 0..179, saturation and value 0..255, as in "
            "100,80,40-125,255,255"
        )
    h0, s0, v0, h1, s1, v1 = (int(part) for part in found.groups())
    if max(h0, h1) > 179 or max(s0, v0, s1, v1) > 255 or s0 > s1 or v0 > v1:
        raise CaptureError(
            f"--hsv {text}: hue is 0..179 (it may wrap through 0), saturation and value are "
            "0..255, the lower one first"
        )
    return ColorRange(hsv_low=(h0, s0, v0), hsv_high=(h1, s1, v1))


def color_at(first: Frame, seeds: Seeds) -> ColorRange | None:
    """The range of the dots under the seeds; None where they are grey, i.e. black or white ink.

    A seed at which there is no patch of paint like the others' has no say; whether there is a dot
    is seen when the colour is known.
    """
    cells = cells_of(first)
    patches: dict[str, PaintPatch] = {}
    for place, (x, y) in seeds.items():
        with contextlib.suppress(CalibrationError):
            patches[place] = find_patch(cells, Pointer(DOTS, 0, x, y))
    alike = _alike(cells, patches)
    if 2 * len(alike) < len(seeds):
        return None
    pointers = [Pointer(DOTS, 0, *seeds[place]) for place in alike]
    return fit(gather([first], pointers).samples)[DOTS]


def widened(color: ColorRange, first: Frame, seeds: Seeds, radius_px: float) -> ColorRange:
    """A range that also takes what is at these seeds: dots that are paler, or in the shade.

    radius_px is that of a dot; its inner half is looked at.
    """
    cells = cells_of(first)
    height, width = cells.shape
    rows, columns = np.mgrid[0:height, 0:width]
    inner = np.zeros(cells.shape, bool)
    for x, y in seeds.values():
        inner |= np.hypot(2 * columns + 0.5 - x, 2 * rows + 0.5 - y) <= max(0.5 * radius_px, 1.5)
    own = cells[inner]
    hue, saturation, value = own.hsv()
    low, high = color.hsv_low, color.hsv_high
    middle = low[0] + 0.5 * ((high[0] - low[0]) % 180)
    turned = hue_difference(hue, middle)
    reach = 0.5 * ((high[0] - low[0]) % 180)
    from_hue = min(-reach, float(turned.min()) - 1.0)
    to_hue = max(reach, float(turned.max()) + 1.0)
    return ColorRange(
        hsv_low=(
            round(middle + from_hue) % 180,
            max(0, min(low[1], int(saturation.min()) - _WIDER)),
            max(0, min(low[2], int(value.min()) - _WIDER)),
        ),
        hsv_high=(round(middle + to_hue) % 180, 255, 255),
    )


def color_about(first: Frame, seeds: Seeds) -> ColorRange:
    """The range of what is right under the seeds, against everything that is not near one.

    For dots that do not stand out enough to be outlined: red on dark skin, in a compressed video.
    """
    cells = cells_of(first)
    height, width = cells.shape
    rows, columns = np.mgrid[0:height, 0:width]
    apart = np.full(cells.shape, np.inf)
    for x, y in seeds.values():
        apart = np.minimum(apart, np.hypot(columns + 0.25 - 0.5 * x, rows + 0.25 - 0.5 * y))
    paint = cells[apart <= _SAMPLED_CELLS]
    # A click may be on a rim: what is least like the skin around is paint.
    around = cells[(apart > _RIM_SHARE * width) & (apart <= 2.0 * _RIM_SHARE * width)]
    skin = np.median(around.chromaticity, axis=0)
    unlike = np.hypot(*(paint.chromaticity - skin).T)
    paint = paint[unlike >= np.median(unlike)]
    foreign = cells[apart > _RIM_SHARE * width]
    return bounds(paint, hues_of(paint), [], foreign, 1)


def _alike(cells: Cells, patches: dict[str, PaintPatch]) -> list[str]:
    """The places of patches of the hue that most have, and of about one size."""
    if len(patches) < 3:
        return list(patches)
    hues = np.array([hues_of(cells[patch.core]).middle for patch in patches.values()])
    near = np.abs(hue_difference(hues[:, None], hues[None, :])) <= _SAME_HUE  # (n, n)
    alike = near[int(np.argmax(near.sum(axis=1)))]
    sizes = np.array([np.count_nonzero(patch.mask) for patch in patches.values()])
    small = sizes <= _MUCH_LARGER * np.median(sizes)
    return [place for place, good in zip(patches, alike & small, strict=True) if good]


def no_dot(place: str, seeds: Seeds, why: str) -> CaptureError:
    """The error of a seed at which there is no dot."""
    x, y = seeds[place]
    return CaptureError(
        f"seed {place}={x:.0f},{y:.0f}: no dot there ({why}); point at the middle of the dot, or "
        "leave a joint without a dot out"
    )
