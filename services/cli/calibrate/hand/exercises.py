"""The exercises, live: what to do now, and what is missing, on standard error."""

from __future__ import annotations

from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.hand_exercises import CYCLE_S, EXERCISES
from rhot.messages import HandPoints
from services.calibrator.endpoints import hand_exercises
from services.cli.router_session import router_session
from services.cli.terminal import Terminal


async def follow_exercises(
    rig: RigConfig, endpoints: list[str], which: HandName
) -> list[HandPoints]:
    """One pass through the exercises, with what to do now and what is missing."""
    hand_exercises.require_hand(rig, which)
    teller, shown = Terminal(), -2

    def tell(now: hand_exercises.Exercising) -> None:
        nonlocal shown
        if now.number == shown:
            return
        shown = now.number
        if now.number < 0:
            begin = f"{CYCLE_S:.0f} s of exercises begin in {hand_exercises.READY_S:.0f} s"
            teller.line(f"{begin}: {EXERCISES[0].prompt}")
            return
        note = f"  (not seen: {', '.join(now.missing)})" if now.missing else ""
        number = f"{now.number + 1:2}/{len(EXERCISES)}"
        teller.line(f"{number}  {EXERCISES[now.number].prompt}{note}")

    async with router_session(rig.rig.name, endpoints) as bus:
        return await hand_exercises.follow_exercises(bus, which, tell)
