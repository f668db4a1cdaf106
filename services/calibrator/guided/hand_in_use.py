"""A hand that is measured while it is used, told in plain words: what is known of each finger's
bones, which motion is still missing, and whether it is good enough to be saved. Pure.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rhot.hand import DIGITS, TIPS, HandName
from rhot.messages.calibration import CalibrationFigure
from services.calibrator.guided.found import Found, figure
from services.calibrator.hand.free_motion.frames import GOOD_SECONDS, MIN_SECONDS
from services.calibrator.hand.free_motion.seen_so_far import SeenSoFar
from services.calibrator.output.hand_file import HandFile

# What is left between a hand and its points, per coordinate, m: a minute of free motion of two
# simulated people with 1 mm of noise left .4 to .6 mm. A real hand's skin and paint may double it.
_RESIDUAL_M = 2e-3
# Of a finger's least certain bone, one standard deviation, m: tables know 3.8 to 5.7 mm, a minute
# left 2.3 to 3.7 mm for the same people, whose bones were then .9 to 3.5 mm off.
_SIGMA_M = 4e-3
# A bar that is full says that it is good; before that it gets no farther.
_NOT_YET = 0.95
# So long without a point, s: who looks on is told.
SILENT_S = 5.0
# Lengths of a finger's file that are no bones of its own.
_NO_BONES = ("root to paint", *(f"{finger} metacarpal" for finger in DIGITS[1:]))


class InUse(NamedTuple):
    """What is known by now."""

    seen: SeenSoFar
    silent_s: float  # since the newest message, or since the beginning
    tries: int  # so often the hand was estimated
    made: HandFile | None  # by the newest try that gave one
    why: str  # why the newest try gave none, "" if it did


class Told(NamedTuple):
    """What a person is told: progress 0..1, what to do next, what was seen so far."""

    progress: float
    to_do: str
    seen: list[str]


def told(now: InUse, which: HandName) -> Told:
    """What to do next, and what was seen."""
    needed = f" of {GOOD_SECONDS:.0f} s" if now.seen.seconds < GOOD_SECONDS else ""
    seen = [f"seen whole for {now.seen.seconds:.0f} s{needed}"]
    if now.seen.missing:
        names = ", ".join(name.replace("_", " ") for name in now.seen.missing)
        seen.append(f"not seen now: {names}")
    if now.why and now.seen.seconds >= MIN_SECONDS:
        seen.append(f"could not be measured: {now.why}")
    progress = _progress(now)
    if now.made is None or not in_use_found(now, which).good:
        progress = min(progress, _NOT_YET)
    return Told(progress, _to_do(now, which), seen)


def in_use_found(now: InUse, which: HandName) -> Found:
    """What may be saved by now; advice is what is missing until it is good."""
    made = now.made
    if made is None:
        return Found({}, False, _bones_so_far(now.seen), [_to_do(now, which)], only_good=True)
    lacking = _bend(made.not_bent)
    if made.seconds < GOOD_SECONDS:
        lacking.append(
            f"Go on using the hand: it was seen whole for {made.seconds:.0f} s, "
            f"{GOOD_SECONDS:.0f} s are needed."
        )
    lacking += _doubts(made)
    figures = [
        *_bones(made),
        figure("knuckles in the palm", f"± {1e3 * max(made.knuckle_sigma_m.values()):.1f} mm"),
        figure("size, an average hand is 1", f"{made.size:.2f}"),
        figure("left between hand and paint", f"{1e3 * made.residual_m:.2f} mm"),
    ]
    return Found({f"hand.{made.hand}.json": made}, not lacking, figures, lacking, only_good=True)


def bone_sigmas_m(made: HandFile) -> dict[str, float]:
    """By digit, one standard deviation of its least certain bone."""
    return {
        digit: max(
            one.sigma_m
            for one in made.lengths
            if one.name.startswith(f"{digit} ") and not one.name.endswith(_NO_BONES)
        )
        for digit in DIGITS
    }


def _to_do(now: InUse, which: HandName) -> str:
    # First: whose hand is at the mouse to press it is not in view.
    if now.made is not None and in_use_found(now, which).good:
        return "Good enough: press Save. Or go on: it becomes more certain."
    if now.silent_s > SILENT_S:
        hint = "" if now.seen.messages else " If it is in view: is fusion running?"
        return f"The {which} hand is not seen. Bring it into view of two cameras.{hint}"
    if now.seen.seconds < 1.0:
        return f"Use the {which} hand as you like, in view of two cameras."
    held = _bend(now.seen.not_bent())
    if held:
        return held[0]
    if now.seen.seconds < GOOD_SECONDS:
        return "Go on as you like: stretch the fingers, make a fist, pinch, turn the hand."
    doubts = [] if now.made is None else _doubts(now.made)
    return doubts[0] if doubts else "Go on: the bones are being measured from what was seen."


def _progress(now: InUse) -> float:
    """The mean of what is asked for: time in view, bent fingers, bones that are known."""
    time = min(now.seen.seconds / GOOD_SECONDS, 1.0)
    bent = 1.0 - len(now.seen.not_bent()) / (len(TIPS) - 1)
    known = 0.0
    if now.made is not None:
        known = min(1.0, _SIGMA_M / max(*bone_sigmas_m(now.made).values(), 1e-9))
    return (time + bent + known) / 3.0


def _doubts(made: HandFile) -> list[str]:
    """What more of the same motion may not mend."""
    sigmas_m, doubts = bone_sigmas_m(made), []
    if made.residual_m > _RESIDUAL_M:
        doubts.append(
            f"The hand does not fit its paint well ({1e3 * made.residual_m:.1f} mm are left, "
            f"{1e3 * _RESIDUAL_M:.0f} mm at most are good): move more slowly, and see that no "
            "camera was moved."
        )
    worst = max(sigmas_m, key=lambda digit: sigmas_m[digit])
    if sigmas_m[worst] > _SIGMA_M:
        doubts.append(
            f"The bones of the {_finger(worst)} are known to {1e3 * sigmas_m[worst]:.1f} mm only "
            f"({1e3 * _SIGMA_M:.0f} mm are needed): stretch and bend it, in view of both cameras."
        )
    return doubts


def _bones_so_far(seen: SeenSoFar) -> list[CalibrationFigure]:
    held = seen.not_bent()
    return [
        _of_bones(digit, "not bent yet" if digit in held else "not known yet") for digit in DIGITS
    ]


def _bones(made: HandFile) -> list[CalibrationFigure]:
    note = dict.fromkeys(made.not_bent, ", not bent yet")
    return [
        _of_bones(digit, f"± {1e3 * sigma_m:.1f} mm{note.get(digit, '')}")
        for digit, sigma_m in bone_sigmas_m(made).items()
    ]


def _of_bones(digit: str, value: str) -> CalibrationFigure:
    return figure(f"bones of the {_finger(digit)}", value)


def _bend(held: Sequence[str]) -> list[str]:
    """What to do with fingers that were held straight, if any were."""
    if not held:
        return []
    names = " and ".join(held) if len(held) < 3 else f"{', '.join(held[:-1])} and {held[-1]}"
    fingers = "finger" if len(held) == 1 else "fingers"
    return [f"Bend the {names} {fingers}, and stretch again."]


def _finger(digit: str) -> str:
    return digit if digit == "thumb" else f"{digit} finger"
