"""A hand that is measured while it is used: told to a page, until somebody saves it or stops."""

from __future__ import annotations

import asyncio

from rhot.errors import CalibrationError
from rhot.messages.simulator import SimStage
from services.calibrator.endpoints.desk import Desk
from services.calibrator.endpoints.hand_exercises import require_hand
from services.calibrator.endpoints.hand_in_use import EVERY_S, hand_in_use
from services.calibrator.endpoints.practice import practising
from services.calibrator.guided.found import Found
from services.calibrator.guided.hand_fitting import Wanted
from services.calibrator.guided.hand_in_use import InUse, in_use_found, told

# Who has not saved it by then has gone away; no more than this is kept of the hand either, s.
_LONGEST_S = 600.0


async def hand_use_step(desk: Desk) -> Found:
    """Offer the hand as soon as it is known; what is known when nobody has saved it in the end.

    Raises CalibrationError if nothing is.
    """
    which = desk.order.hand
    require_hand(desk.config, which)
    loop = asyncio.get_running_loop()
    ends_s = loop.time() + _LONGEST_S

    def tell(now: InUse) -> bool:
        desk.tell(*told(now, which))
        desk.offer(in_use_found(now, which))
        return loop.time() >= ends_s

    # All joints wander: more than a person does, who needs a minute of everything.
    async with practising(desk, SimStage(scene="random")):
        wanted = Wanted(which, f"the page, in use, rig {desk.config.rig.name}", desk.date())
        now = await hand_in_use(desk.bus, wanted, tell, EVERY_S)
    if now.made is None:
        why = now.why or f"the {which} hand was not seen"
        raise CalibrationError(f"nothing is known after {_LONGEST_S / 60:.0f} minutes: {why}")
    return in_use_found(now, which)
