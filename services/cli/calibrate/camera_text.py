"""What `rhot calibrate colors` and `camera` say, and the picture that shows what was taken for
paint. Pure.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from rhot.camera_messages import ExposureControl
from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.colors.exposure_advice import ExposureStatistics
from services.pi_tracker.colors.fit import TrainingSet
from services.pi_tracker.colors.paint_names import Suggestion
from services.pi_tracker.colors.propose import Proposal
from services.pi_tracker.colors.report import Report
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import picture


def range_text(span: ColorRange) -> str:
    """hue, saturation and value from to, as OpenCV has them."""
    return " ".join(
        f"{name} {low:3d}..{high:3d}"
        for name, low, high in zip("hsv", span.hsv_low, span.hsv_high, strict=True)
    )


def report_text(report: Report, fitted: dict[str, ColorRange]) -> str:
    """A line per colour, and how each is told from its nearest."""
    lines = []
    for one in report.colors:
        line = f"{one.color:10s} {range_text(fitted[one.color])}   takes {100 * one.inside:.0f} % of {4 * one.cells} px in {one.pictures}"
        line += " picture" + ("s" if one.pictures > 1 else "")
        pairs = [
            pair
            for pair in report.pairs
            if one.color in (pair.a, pair.b) and pair.separation >= 0.0
        ]
        if pairs:
            near = min(pairs, key=lambda pair: pair.separation)
            line += f"; nearest {near.b if near.a == one.color else near.a}, d' {near.separation}"
        line += f"; skin, d' {one.skin}" if one.skin >= 0.0 else "; no skin in the pictures"
        lines.append(line)
    return "\n".join(lines)


def proposals_text(proposals: Sequence[Proposal], suggestions: Sequence[Suggestion]) -> str:
    """What stands out, ready to be given as --box or --at, and what else would."""
    lines = ["these patches stand out:"]
    for one in proposals:
        x, y, w, h = (
            round(v)
            for v in (
                one.boxes[0].x_px,
                one.boxes[0].y_px,
                one.boxes[0].width_px,
                one.boxes[0].height_px,
            )
        )
        lines.append(
            f"  {one.color:10s} hue {one.hue:5.1f}, seen in {one.pictures} picture(s), e.g. --box {one.color}={x},{y},{w},{h}"
        )
    free = ", ".join(f"{one.color} ({one.clearance:.0f} hues clear)" for one in suggestions)
    lines.append(
        f"further paints that would stand out from skin, room and these: {free or 'none of the common ones'}"
    )
    return "\n".join(lines)


def overlay(training: TrainingSet, frames: Sequence[Frame], colors: Colors) -> Image:
    """The pictures one below the other: what the ranges take in white, boxes around what was
    pointed at.
    """
    names = sorted(colors.colors)
    table = compile_colors(colors, names)
    shown = []
    for number, frame in enumerate(frames):
        image = picture(frame)
        luma, chroma = image.cells((0, 0, *image.size))
        labels = table.classify(luma, chroma)
        bgr = (
            frame.image.copy()
            if frame.layout == "bgr"
            else cv2.cvtColor(frame.image, cv2.COLOR_YUV2BGR_I420)
        )
        mask = cv2.resize(
            (labels > 0).astype(np.uint8),
            (bgr.shape[1], bgr.shape[0]),
            interpolation=cv2.INTER_NEAREST,
        )
        bgr[mask > 0] = 255
        for color, samples in training.samples.items():
            for patch in samples.patches:
                if patch.frame == number:
                    x, y, w, h = patch.box_px
                    cv2.rectangle(bgr, (x - 2, y - 2), (x + w + 1, y + h + 1), (0, 0, 255), 1)
                    cv2.putText(
                        bgr,
                        color,
                        (x, max(y - 6, 10)),
                        cv2.FONT_HERSHEY_SIMPLEX,
                        0.4,
                        (0, 0, 255),
                        1,
                        cv2.LINE_AA,
                    )
        shown.append(bgr)
    return np.vstack(shown)


def light_text(light: ExposureStatistics) -> str:
    """One line on the light in the pictures."""
    cast = (
        "nothing neutral in view"
        if light.red_cast is None or light.blue_cast is None
        else (f"cast of red {100 * light.red_cast:+.0f} %, blue {100 * light.blue_cast:+.0f} %")
    )
    return f"median brightness {light.value:.0f} of 255, {100 * light.clipped:.1f} % overexposed, {100 * light.black:.0f} % black, {cast}"


def exposure_text(state: ExposureControl) -> str:
    """One line on the exposure in force."""
    if state.exposure_us <= 0.0:
        return f"exposure unknown ({state.note})" if state.note else "exposure unknown"
    values = f"{state.exposure_us:.0f} us, gain {state.gain:.2f}, red gain {state.red_gain:.2f}, blue gain {state.blue_gain:.2f}"
    return f"exposure {values}, {state.mode}" + (f" ({state.note})" if state.note else "")
