"""What `rhot calibrate colors` and `camera` print, and the picture of what was taken for paint.
Pure.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from rhot.files.calibration import ColorRange, Colors
from rhot.messages.camera import ExposureControl
from services.pi_tracker.colors.exposure_advice import ExposureStatistics
from services.pi_tracker.colors.fit import TrainingSet
from services.pi_tracker.colors.proposal.paint_names import Suggestion
from services.pi_tracker.colors.proposal.propose import Proposal
from services.pi_tracker.colors.report import Report
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import bgr_image, picture

# Of boxes and names, BGR.
_RED = (0, 0, 255)


def range_text(span: ColorRange) -> str:
    """Hue, saturation and value from to, as OpenCV has them."""
    return " ".join(
        f"{name} {low:3d}..{high:3d}"
        for name, low, high in zip("hsv", span.hsv_low, span.hsv_high, strict=True)
    )


def report_text(report: Report, fitted: dict[str, ColorRange]) -> str:
    """A line per colour, and how each is told from its nearest."""
    lines = []
    for one in report.colors:
        plural = "s" if one.pictures > 1 else ""
        line = (
            f"{one.color:10s} {range_text(fitted[one.color])}   takes {100 * one.inside:.0f} % "
            f"of {4 * one.cells} px in {one.pictures} picture{plural}"
        )
        pairs = [
            pair
            for pair in report.pairs
            if one.color in (pair.a, pair.b) and pair.separation >= 0.0
        ]
        if pairs:
            near = min(pairs, key=lambda pair: pair.separation)
            other = near.b if near.a == one.color else near.a
            line += f"; nearest {other}, d' {near.separation}"
        line += f"; skin, d' {one.skin}" if one.skin >= 0.0 else "; no skin in the pictures"
        lines.append(line)
    return "\n".join(lines)


def proposals_text(proposals: Sequence[Proposal], suggestions: Sequence[Suggestion]) -> str:
    """What stands out, ready to be given as --box or --at, and what else would."""
    lines = ["these patches stand out:"]
    for one in proposals:
        first = one.boxes[0]
        x, y, w, h = map(round, (first.x_px, first.y_px, first.width_px, first.height_px))
        lines.append(
            f"  {one.color:10s} hue {one.hue:5.1f}, {'moves' if one.moves else 'stands still'}, "
            f"seen in {one.pictures} picture(s), e.g. --box {one.color}={x},{y},{w},{h}"
        )
    free = ", ".join(f"{one.color} ({one.clearance:.0f} hues clear)" for one in suggestions)
    lines.append(
        "further paints that would stand out from skin, room and these: "
        f"{free or 'none of the common ones'}"
    )
    return "\n".join(lines)


def overlay(training: TrainingSet, frames: Sequence[Frame], colors: Colors) -> Image:
    """The pictures one below the other: what the ranges take in white, boxes around what was
    pointed at.
    """
    table = compile_colors(colors, sorted(colors.colors))
    shown = []
    for number, frame in enumerate(frames):
        image = picture(frame)
        luma, chroma = image.cells((0, 0, *image.size))
        labels = table.classify(luma, chroma)
        bgr = bgr_image(frame).copy()
        size = (bgr.shape[1], bgr.shape[0])
        taken = cv2.resize((labels > 0).astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        bgr[taken > 0] = 255
        for color, samples in training.samples.items():
            for patch in samples.patches:
                if patch.frame == number:
                    _draw_box(bgr, color, patch.box_px)
        shown.append(bgr)
    return np.vstack(shown)


def _draw_box(bgr: Image, color: str, box_px: tuple[int, int, int, int]) -> None:
    """A box with the colour's name above it."""
    x, y, w, h = box_px
    cv2.rectangle(bgr, (x - 2, y - 2), (x + w + 1, y + h + 1), _RED, 1)
    corner, font = (x, max(y - 6, 10)), cv2.FONT_HERSHEY_SIMPLEX
    cv2.putText(bgr, color, corner, font, 0.4, _RED, 1, cv2.LINE_AA)


def light_text(light: ExposureStatistics) -> str:
    """One line on the light in the pictures."""
    cast = "nothing neutral in view"
    if light.red_cast is not None and light.blue_cast is not None:
        cast = f"cast of red {100 * light.red_cast:+.0f} %, blue {100 * light.blue_cast:+.0f} %"
    return (
        f"median brightness {light.value:.0f} of 255, {100 * light.clipped:.1f} % overexposed, "
        f"{100 * light.black:.0f} % black, {cast}"
    )


def exposure_text(state: ExposureControl) -> str:
    """One line on the exposure in use."""
    note = f" ({state.note})" if state.note else ""
    if state.exposure_us <= 0.0:
        return f"exposure unknown{note}"
    values = (
        f"{state.exposure_us:.0f} us, gain {state.gain:.2f}, red gain {state.red_gain:.2f}, "
        f"blue gain {state.blue_gain:.2f}"
    )
    return f"exposure {values}, {state.mode}{note}"
