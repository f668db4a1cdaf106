"""The exercises of a hand, live: a person is told what to do, and its points are kept."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS, HANDS, HandName
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages import HandPoints

# Time to read the first exercise and bring the hand into view.
READY_S = 3.0
# So long without a message from fusion nobody need go on.
_SILENT_S = 5.0


class Exercising(NamedTuple):
    """How far a person is: number of the exercise, -1 before the first; landmarks not seen now."""

    number: int
    passed_s: float
    missing: list[str]


async def follow_exercises(
    bus: Bus, which: HandName, tell: Callable[[Exercising], None], pace: float = 1.0
) -> list[HandPoints]:
    """One pass through the exercises; `tell` hears of every message.

    A simulated hand may do them at another pace: 2 in half the time. The stamps that come back are
    those of the usual pace, as if its time had passed more slowly.

    Raises CalibrationError if no points come.
    """
    tell(Exercising(-1, 0.0, []))
    await asyncio.sleep(READY_S)
    # Not before: points that came meanwhile would count as the first seconds of the exercises.
    points = bus.every(topics.POINTS, 256, hand=which)
    messages: list[HandPoints] = []
    try:
        passed_s, began_ns = 0.0, 0
        # By the hand's own time, from its first point on: a recording must hold all of them.
        while passed_s <= CYCLE_S:
            try:
                message = await asyncio.wait_for(anext(points), _SILENT_S)
            except TimeoutError:
                raise CalibrationError(
                    f"no points of the {which} hand for {_SILENT_S:.0f} s: is fusion running and "
                    "the hand in view? `rhot top` shows it"
                ) from None
            began_ns = began_ns or message.stamp_ns
            passed_ns = round(pace * (message.stamp_ns - began_ns))
            messages.append(msgspec.structs.replace(message, stamp_ns=began_ns + passed_ns))
            passed_s = 1e-9 * passed_ns
            number = min(int(passed_s // EXERCISE_S), len(EXERCISES) - 1)
            tell(Exercising(number, passed_s, _missing(message)))
    finally:
        bus.close(points)
    return messages


def require_hand(rig: RigConfig, which: HandName) -> None:
    """Raises CalibrationError if rig.toml has no such hand."""
    if which not in rig.hand:
        others = ", ".join(hand for hand in HANDS if hand in rig.hand) or "no hand"
        raise CalibrationError(f"rig.toml has no [hand.{which}.markers]; it has {others}")


def _missing(message: HandPoints) -> list[str]:
    seen = {point.name for point in message.points if point.source == "measured"}
    return [name for name in BASIC_LANDMARKS if name not in seen]
