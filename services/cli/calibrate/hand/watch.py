"""A hand that measures itself while somebody uses the rig, on a terminal.

Every 20 s what is known by then is told. What goes wrong meanwhile (no hand, a hand held still) is
told too, and waited out; Ctrl-C ends it, and nothing is written.
"""

from __future__ import annotations

import uvloop

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from services.calibrator.endpoints.hand_exercises import require_hand
from services.calibrator.endpoints.hand_in_use import EVERY_S, hand_in_use
from services.calibrator.guided.hand_fitting import Wanted
from services.calibrator.guided.hand_in_use import SILENT_S, InUse
from services.calibrator.output.hand_file import HandFile
from services.calibrator.output.hand_report import proposal_text
from services.cli.router_session import router_session
from services.cli.terminal import Terminal


def watch_hand(rig: RigConfig, endpoints: list[str], wanted: Wanted, seconds: float) -> HandFile:
    """The hand, once it was in view for so many seconds.

    Raises BusError without a router, CalibrationError if there is no such hand, or on Ctrl-C.
    """
    require_hand(rig, wanted.hand)
    teller = Terminal()
    teller.line(
        f"Use the rig as you like for {seconds:.0f} s with the {wanted.hand} hand in view of two "
        "cameras: stretch the fingers, make a fist, bend them one by one, pinch, turn the hand. "
        "Ctrl-C ends."
    )
    try:
        return uvloop.run(watched_hand(rig.rig.name, endpoints, wanted, seconds, teller))
    except KeyboardInterrupt:
        raise CalibrationError("ended by Ctrl-C: nothing was written") from None
    finally:
        teller.end()


async def watched_hand(
    rig: str,
    endpoints: list[str],
    wanted: Wanted,
    seconds: float,
    teller: Terminal,
    every_s: float = EVERY_S,
) -> HandFile:
    """The hand, once it was in view for so many seconds; estimated every_s."""
    watch = _Watch(teller, wanted, seconds)
    async with router_session(rig, endpoints) as bus:
        known = await hand_in_use(bus, wanted, watch.enough, every_s)
    if known.made is None:
        raise CalibrationError(f"the {wanted.hand} hand was not seen: bring it into view")
    return known.made


class _Watch:
    """What a terminal was told already."""

    def __init__(self, teller: Terminal, wanted: Wanted, seconds: float) -> None:
        self._teller, self._wanted, self._seconds = teller, wanted, seconds
        self._tries, self._silent = 0, False

    def enough(self, now: InUse) -> bool:
        """Tell each estimate and each silence once; whether the hand was in view for long."""
        silent = now.silent_s > SILENT_S
        if silent and not self._silent:
            self._teller.line(
                f"no points of the {self._wanted.hand} hand for {SILENT_S:.0f} s: is fusion "
                "running and the hand in view? `rhot top` shows it"
            )
        self._silent = silent
        if now.tries == self._tries:
            return False
        self._tries = now.tries
        if now.why or now.made is None:
            self._teller.line(f"not yet: {now.why}")
            return False
        self._teller.line(proposal_text(now.made))
        return now.made.seconds >= self._seconds
