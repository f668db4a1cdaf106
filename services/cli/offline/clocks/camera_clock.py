"""What is known of a camera's clock against the first camera's: clocks.json, and in words."""

from __future__ import annotations

from typing import Literal

import msgspec

# aligned: without a common clock, put right by the markers' motion; likeliest: by the likeliest of
# several offsets that fit a motion which repeats itself. by hand: by --offset. as
# stamped: the markers agree with the stamps, or cannot tell and the stamps are on one clock.
# corrected: the markers contradict stamps of one clock, and put them right; contradicted: the
# stamps are kept all the same. unknown: nothing tells.
Verdict = Literal[
    "aligned", "likeliest", "by hand", "as stamped", "corrected", "contradicted", "unknown"
]


class CameraClock(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """By how much a camera's times are later than those of the camera that it is held against.

    offset_s holds where that camera's clock reads at_s, seconds since its first frame; drift_ppm is
    by how much it grows. found: whether the markers' motion tells offset and drift, searched within
    +-range_s; why_not if not.
    residual_px is the height difference that is left (robust RMS). second_offset_s is the offset
    that fits second best, with what it leaves and by how much it is less likely (log-likelihood).
    """

    camera: str
    against: str
    verdict: Verdict
    used_offset_s: float
    used_drift_ppm: float = 0.0
    found: bool
    range_s: float
    why_not: str = ""
    offset_s: float | None = None
    offset_sigma_s: float | None = None
    at_s: float | None = None
    offset_at_start_s: float | None = None
    drift_ppm: float | None = None
    drift_sigma_ppm: float | None = None
    residual_px: float | None = None
    wander_s: float | None = None
    second_offset_s: float | None = None
    second_residual_px: float | None = None
    better: float | None = None


def found_text(one: CameraClock) -> str:
    """What the markers' motion tells, in words."""
    if not one.found or one.offset_s is None or one.at_s is None:
        return f"the markers' motion does not tell: {_why_not(one)}"
    text = (
        f"{one.camera}'s times are {_seconds(one.offset_s)} than {one.against}'s, "
        f"+-{_ms(one.offset_sigma_s)} ms"
    )
    if one.drift_ppm is not None and one.drift_sigma_ppm is not None:
        text += f"; drift {one.drift_ppm:+.1f} +-{one.drift_sigma_ppm:.1f} ppm"
        if abs(one.drift_ppm) > 2.0 * one.drift_sigma_ppm:
            text += f" (at {one.at_s:.1f} s of {one.against}; {one.offset_at_start_s:+.4f} s at 0)"
    return f"{text}; residual {one.residual_px:.2f} px"


def clock_text(one: CameraClock) -> str:
    """One line for people."""
    if one.verdict == "by hand":
        return (
            f"clock of {one.camera}: {_seconds(one.used_offset_s)} than {one.against}'s, by hand "
            f"({found_text(one)})"
        )
    return f"clock of {one.camera}: {found_text(one)}"


def warnings_of(one: CameraClock) -> list[str]:
    """What a person must know of a clock, each in a sentence or two."""
    told = []
    if one.verdict == "unknown":
        told.append(
            f"{one.camera}: its clock is not {one.against}'s, and the markers do not tell the "
            f"offset within +-{one.range_s:.0f} s: {_why_not(one)}. The recordings are taken to "
            "begin together, and points are off by as much as the hand moves meanwhile; film some "
            "seconds of irregular motion that both see, or give it by hand: "
            f"--offset {one.camera}=SECONDS"
        )
    if one.verdict == "likeliest":
        told.append(
            f"{one.camera}: its clock is not {one.against}'s, and {_why_not(one)}. The likelier is "
            "taken, by which points are right where the motion is the same each time; film some "
            "seconds of irregular motion that both see, or give it by hand: "
            f"--offset {one.camera}=SECONDS"
        )
    if one.verdict == "corrected":
        told.append(
            f"{one.camera}: its stamps contradict the markers' motion and are put right: "
            f"{found_text(one)}; if they are right all the same: --offset {one.camera}=0"
        )
    if one.verdict == "contradicted":
        told.append(
            f"{one.camera}: its stamps contradict the markers' motion: {found_text(one)}; they are "
            "kept, since rig.toml says [fusion] tune_clocks = false"
        )
    if one.verdict == "by hand" and one.found and contradicts(one):
        told.append(
            f"--offset {one.camera}={one.used_offset_s:g} contradicts the markers' motion: "
            f"{found_text(one)}"
        )
    if one.found and one.wander_s is not None and one.wander_s > 3e-3:
        told.append(
            f"{one.camera}: its offset to {one.against} wanders by {_ms(one.wander_s)} ms about a "
            "steady drift: frames that were dropped without a trace in their times, or wrong "
            "markers"
        )
    return told


def contradicts(one: CameraClock) -> bool:
    """Whether an offset by hand is another one than that which was found."""
    if one.offset_s is None or one.offset_sigma_s is None:
        return False
    return abs(one.used_offset_s - one.offset_s) > 4.0 * one.offset_sigma_s + 1e-3


def _why_not(one: CameraClock) -> str:
    """Why the markers do not tell, with what fits best and second best."""
    if one.offset_s is None or one.second_offset_s is None:
        return one.why_not
    return (
        f"{one.why_not} ({one.offset_s:+.3f} s leaves {one.residual_px:.2f} px, "
        f"{one.second_offset_s:+.3f} s {one.second_residual_px:.2f} px)"
    )


def _seconds(offset_s: float) -> str:
    return f"{abs(offset_s):.4f} s {'earlier' if offset_s < 0.0 else 'later'}"


def _ms(seconds: float | None) -> str:
    return "?" if seconds is None else f"{1e3 * seconds:.2f}"
