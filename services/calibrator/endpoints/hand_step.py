"""The exercises of a hand, told to a page, and the hand that comes of them."""

from __future__ import annotations

import asyncio

from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages.simulator import SimStage
from services.calibrator.endpoints.desk import Desk
from services.calibrator.endpoints.hand_exercises import (
    READY_S,
    Exercising,
    follow_exercises,
    require_hand,
)
from services.calibrator.endpoints.practice import practising
from services.calibrator.guided.found import Found
from services.calibrator.guided.hand import hand_found
from services.calibrator.guided.hand_fitting import Wanted, from_exercises

# A simulated hand does the exercises so much faster than a person can follow.
_PACE = 2.0


async def hand_step(desk: Desk) -> Found:
    """One pass through the exercises. Raises CalibrationError if they show no hand."""
    which = desk.order.hand
    require_hand(desk.config, which)

    pace = 1.0

    def tell(now: Exercising) -> None:
        if now.number < 0:
            first = EXERCISES[0].prompt
            desk.tell(0.0, f"In {READY_S:.0f} seconds: {first}", [])
            return
        left_s = (EXERCISE_S * (now.number + 1) - now.passed_s) / pace
        seen = [f"exercise {now.number + 1} of {len(EXERCISES)}, {max(left_s, 0.0):.0f} s left"]
        if now.missing:
            names = ", ".join(name.replace("_", " ") for name in now.missing)
            seen.append(f"not seen now: {names}")
        desk.tell(now.passed_s / CYCLE_S, EXERCISES[now.number].prompt, seen)

    stage = SimStage(scene="guided", speed=_PACE, begins_in_s=READY_S)
    async with practising(desk, stage) as performer:
        pace = _PACE if performer else 1.0
        messages = await follow_exercises(desk.bus, which, tell, pace)
    desk.computing("The bones are being fitted to what was seen; this takes some seconds.")
    wanted = Wanted(which, f"the page, rig {desk.config.rig.name}", desk.date())
    made = await asyncio.to_thread(from_exercises, messages, wanted)
    return hand_found(made)
