"""Millimetres per pixel: from a bone's known length, or given; px where nothing says. Pure.

What makes a finger of impossible size is refused: metres were given for millimetres.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rhot.errors import CaptureError
from studies.grasp.measure.joints import FINGERS, Finger
from studies.grasp.recording import Joint

# A phalanx from a small child's to twice an adult's: Buryanov & Kotiuk 2010 measured 15.8 to
# 44.6 mm of adults (thumb's metacarpal 46.2), n = 66.
_PHALANX_MM = (5.0, 95.0)
_LENGTH = re.compile(r"(?P<finger>[a-z]+)_(?P<bone>[a-z]+)_mm=(?P<mm>[\d.eE+-]+)")
_EXAMPLE = "--length index_proximal_mm=43.6"
# The bone that begins at each joint; the thumb has no middle one.
BONES: dict[Joint, str] = {"mcp": "proximal", "pip": "middle", "dip": "distal"}


class Scale(NamedTuple):
    """Units of the recording per px; sigma is relative."""

    per_px: float
    sigma: float
    unit: str
    note: str = ""


NO_SCALE = Scale(
    1.0,
    0.0,
    "px",
    "no reference length: lengths are in px (--length, --scale-mm-per-px)",
)


def parse_lengths(texts: Iterable[str]) -> dict[tuple[Finger, Joint], float]:
    """Known lengths of the command line, mm, by finger and the joint at which the bone begins."""
    known: dict[tuple[Finger, Joint], float] = {}
    for text in texts:
        found = _LENGTH.fullmatch(text.replace(" ", ""))
        joint = next((j for j, bone in BONES.items() if found and bone == found["bone"]), None)
        finger = next((one for one in FINGERS if found and one == found["finger"]), None)
        if not found or joint is None or finger is None:
            raise CaptureError(
                f"--length {text}: is not finger_bone_mm=length, as in {_EXAMPLE}; bones are "
                f"{', '.join(BONES.values())}"
            )
        try:
            mm = float(found["mm"])
        except ValueError:
            raise CaptureError(f"--length {text}: {found['mm']} is no number") from None
        _check(f"--length {text}", found["bone"], mm)
        known[finger, joint] = mm
    return known


def _check(given: str, bone: str, mm: float) -> None:
    """Raises CaptureError where no bone is that long."""
    low, high = _PHALANX_MM
    if not low <= mm <= high:
        metres = low <= 1e3 * mm <= high
        advice = f"; metres were given: write {1e3 * mm:g}" if metres else ""
        raise CaptureError(
            f"{given}: a {bone} phalanx of {mm:g} mm; they are {low:g} to {high:g} mm long{advice}"
        )


def known_scale(mm_per_px: float, measured_px: Mapping[str, float]) -> Scale:
    """A scale that was given; measured_px: the median length of each bone, for plausibility."""
    if not (math.isfinite(mm_per_px) and mm_per_px > 0.0):
        raise CaptureError(f"--scale-mm-per-px {mm_per_px}: a scale is above 0")
    for bone, length_px in measured_px.items():
        _check(f"--scale-mm-per-px {mm_per_px:g}", bone, mm_per_px * length_px)
    return Scale(mm_per_px, 0.0, "mm")


def scale_of_lengths(
    known_mm: Mapping[tuple[Finger, Joint], float],
    measured_px: Mapping[tuple[Finger, Joint], tuple[float, float]],
) -> Scale:
    """The scale that fits known lengths best; measured_px: median and its sigma of each bone.

    Several lengths: their mean, weighted by how well each was measured; sigma is then at least what
    they disagree by.
    """
    ratios: list[tuple[float, float]] = []
    missing = []
    for (finger, joint), mm in known_mm.items():
        if (finger, joint) not in measured_px:
            missing.append(f"{finger}_{BONES[joint]}")
            continue
        px, sigma_px = measured_px[finger, joint]
        ratios.append((mm / px, max(sigma_px / px, 1e-4)))
    if not ratios:
        seen = ", ".join(f"{finger}_{BONES[joint]}" for finger, joint in measured_px) or "none"
        raise CaptureError(
            f"--length: {', '.join(missing)} was not seen in the video; measured were: {seen}"
        )
    weights = [sigma**-2 for _, sigma in ratios]
    per_px = sum(w * r for w, (r, _) in zip(weights, ratios, strict=True)) / sum(weights)
    spread = math.sqrt(sum((r / per_px - 1.0) ** 2 for r, _ in ratios) / len(ratios) ** 2)
    note = f"not seen, so not used: {', '.join(missing)}" if missing else ""
    return Scale(per_px, max(sum(weights) ** -0.5, spread), "mm", note)
