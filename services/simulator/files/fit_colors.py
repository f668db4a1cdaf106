"""Colour ranges for the simulated rig, fitted to rendered pixels whose surface is known. Pure.

It does what a person does by clicking on painted fingers, with the renderer's labels instead of
clicks: the hue range holds the bulk of the samples, saturation and value go as low as skin and
background allow. A colour that nothing in the scenes has is a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors
from services.simulator.render.renderer import Renderer

Samples = npt.NDArray[np.int64]  # (n, 3) OpenCV HSV
# Percentage of the samples left out at either end of the hue range: a few pixels at shaded rims are
# not worth a wide range.
_TAIL = 1.0
# Hues a little outside what was seen belong to the range: another place, another pose.
_HUE_SLACK = 3
# How much less saturated and darker than what was seen a pixel may be: shade darkens more than it
# greys. Below the floors noise of 4.5 grey levels spoils the hue, and skin and walls are there.
_SATURATION_SHARE, _VALUE_SHARE = 0.85, 0.65
_MIN_SATURATION, _MIN_VALUE = 70, 35


def sample_pixels(renderer: Renderer, frames: Iterable[int]) -> tuple[dict[int, Samples], Samples]:
    """HSV of the pixels of each painted surface, and of everything else, noise included.

    Outlines are left out.
    """
    painted: dict[int, list[Samples]] = {}
    other: list[Samples] = []
    kernel = np.ones((3, 3), np.uint8)
    for frame in frames:
        bgr = cv2.cvtColor(renderer.picture(frame), cv2.COLOR_YUV2BGR_I420)
        hsv = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV).astype(np.int64)
        labels = renderer.labels(renderer.clock.time_s(frame))
        paint = np.zeros(labels.shape, np.uint8)
        shapes = renderer.shapes
        for surface in (*shapes.paint_surfaces.values(), *shapes.marker_surfaces.values()):
            mask = (labels == 1 + surface).astype(np.uint8)
            paint |= mask
            painted.setdefault(surface, []).append(hsv[cv2.erode(mask, kernel) > 0])
        other.append(hsv[cv2.dilate(paint, kernel, iterations=3) == 0][::7])
    by_surface = {surface: np.concatenate(rows) for surface, rows in painted.items()}
    return by_surface, np.concatenate(other)


def fit_ranges(painted: dict[str, Samples], other: Samples, date: str, tool: str) -> Colors:
    """Ranges of all colours.

    residuals tell which share of a colour's samples its range takes, and which share of all others.
    """
    ranges, residuals = {}, {}
    for name, seen in sorted(painted.items()):
        if len(seen) < 50:
            raise CalibrationError(
                f"colour {name!r}: {len(seen)} pixels of it in the rendered scenes;"
                " mark a landmark that the cameras see"
            )
        ranges[name] = _fit_range(seen)
        rest = np.concatenate([other, *(rows for key, rows in painted.items() if key != name)])
        residuals[name] = {
            "inside": round(float(in_range(ranges[name], seen).mean()), 4),
            "others_inside": round(float(in_range(ranges[name], rest).mean()), 6),
        }
    counts = {name: len(rows) for name, rows in sorted(painted.items())}
    return Colors(
        date=date,
        tool=tool,
        inputs={"samples": counts, "others": len(other)},
        residuals=residuals,
        colors=ranges,
    )


def _fit_range(seen: Samples) -> ColorRange:
    """One colour's range; hues are unwrapped about their circular mean, since red wraps round."""
    angle = seen[:, 0] * (np.pi / 90.0)
    weight = seen[:, 1]
    mean_sin, mean_cos = np.sum(weight * np.sin(angle)), np.sum(weight * np.cos(angle))
    centre = np.arctan2(mean_sin, mean_cos) * (90.0 / np.pi)
    hue = (seen[:, 0] - centre + 90.0) % 180.0 - 90.0
    low, high = np.percentile(hue, [_TAIL, 100.0 - _TAIL])
    h_low = round(centre + low - _HUE_SLACK) % 180
    h_high = round(centre + high + _HUE_SLACK) % 180
    s_low = max(_MIN_SATURATION, int(_SATURATION_SHARE * np.percentile(seen[:, 1], _TAIL)))
    v_low = max(_MIN_VALUE, int(_VALUE_SHARE * np.percentile(seen[:, 2], _TAIL)))
    return ColorRange(hsv_low=(h_low, s_low, v_low), hsv_high=(h_high, 255, 255))


def in_range(bounds: ColorRange, hsv: Samples) -> npt.NDArray[np.bool_]:
    """Which samples (n, 3) a range takes; (n,)."""
    low, high = np.array(bounds.hsv_low), np.array(bounds.hsv_high)
    above, below = hsv[:, 0] >= low[0], hsv[:, 0] <= high[0]
    hue = above & below if low[0] <= high[0] else above | below
    return hue & np.all((hsv[:, 1:] >= low[1:]) & (hsv[:, 1:] <= high[1:]), axis=1)
