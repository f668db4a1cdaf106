"""The exercises, live: what to do now, and what is missing."""

from __future__ import annotations

import asyncio
import time

from rhot.client import RigClient
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS, HANDS, HandName
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages import HandPoints
from services.cli.router_session import router_session
from services.cli.terminal import Terminal

# Time to read the first exercise and bring the hand into view.
_READY_S = 3.0
# So long without a message from fusion nobody need go on.
_SILENT_S = 5.0


async def follow_exercises(
    rig: RigConfig, endpoints: list[str], which: HandName
) -> list[HandPoints]:
    """One pass through the exercises, with what to do now and what is missing on standard error."""
    require_hand(rig, which)
    teller, messages, shown = Terminal(), [], -1
    async with router_session(rig.rig.name, endpoints) as bus:
        stream = RigClient(bus).hand_points(which, queue=256)
        teller.line(
            f"{CYCLE_S:.0f} s of exercises begin in {_READY_S:.0f} s: {EXERCISES[0].prompt}"
        )
        await asyncio.sleep(_READY_S)
        began_s = time.monotonic()
        while (passed_s := time.monotonic() - began_s) < CYCLE_S:
            try:
                message = await asyncio.wait_for(anext(stream), _SILENT_S)
            except TimeoutError:
                raise CalibrationError(
                    f"no points of the {which} hand for {_SILENT_S:.0f} s: is fusion running and "
                    "the hand in view? `rhot top` shows it"
                ) from None
            messages.append(message)
            number = min(int(passed_s // EXERCISE_S), len(EXERCISES) - 1)
            if number != shown:
                shown = number
                missing = _missing(message)
                note = f"  (not seen: {missing})" if missing else ""
                teller.line(f"{number + 1:2}/{len(EXERCISES)}  {EXERCISES[number].prompt}{note}")
    return messages


def require_hand(rig: RigConfig, which: HandName) -> None:
    """Raises CalibrationError if rig.toml has no such hand."""
    if which not in rig.hand:
        others = ", ".join(hand for hand in HANDS if hand in rig.hand) or "no hand"
        raise CalibrationError(f"rig.toml has no [hand.{which}.markers]; it has {others}")


def _missing(message: HandPoints) -> str:
    seen = {point.name for point in message.points if point.source == "measured"}
    return ", ".join(name for name in BASIC_LANDMARKS if name not in seen)
