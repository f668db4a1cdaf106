"""A hand that measures itself: points are collected while somebody uses the rig, in the background.

Every 20 s the hand is estimated from all that was seen, in a thread, and what is known by then is
told. What goes wrong meanwhile (no hand, a hand held still) is told too, and waited out; Ctrl-C
ends it, and nothing is written.
"""

from __future__ import annotations

import asyncio
from collections import deque

import uvloop

from rhot.client import RigClient
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.messages import HandPoints
from services.calibrator.endpoints.hand_exercises import require_hand
from services.calibrator.guided.hand_fitting import Wanted, from_motion
from services.calibrator.output.hand_file import HandFile
from services.calibrator.output.hand_report import proposal_text
from services.cli.router_session import router_session
from services.cli.terminal import Terminal

# Between two estimates; each takes 3 to 6 s of one core, on this computer alone.
_EVERY_S = 20.0
# So long without a point is told, once.
_SILENT_S = 5.0
# The newest messages: 10 minutes of two cameras at 30 Hz.
_MOST_MESSAGES = 36_000


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
        return uvloop.run(hand_in_use(rig.rig.name, endpoints, wanted, seconds, teller))
    except KeyboardInterrupt:
        raise CalibrationError("ended by Ctrl-C: nothing was written") from None
    finally:
        teller.end()


async def hand_in_use(
    rig: str,
    endpoints: list[str],
    wanted: Wanted,
    seconds: float,
    teller: Terminal,
    every_s: float = _EVERY_S,
) -> HandFile:
    """The hand, once it was in view for so many seconds; estimated every_s."""
    messages: deque[HandPoints] = deque(maxlen=_MOST_MESSAGES)
    async with router_session(rig, endpoints) as bus:
        listening = asyncio.create_task(_listen(RigClient(bus), wanted, messages, teller))
        try:
            while True:
                # A bus that fails ends the wait.
                await asyncio.wait({listening}, timeout=every_s)
                if listening.done():
                    listening.result()
                if not messages:
                    continue
                try:
                    made = await asyncio.to_thread(from_motion, tuple(messages), wanted)
                except CalibrationError as error:
                    teller.line(f"not yet: {error}")
                    continue
                teller.line(proposal_text(made))
                if made.seconds >= seconds:
                    return made
        finally:
            listening.cancel()


async def _listen(
    client: RigClient, wanted: Wanted, messages: deque[HandPoints], teller: Terminal
) -> None:
    """Collect points, and tell once of each silence."""
    stream = client.hand_points(wanted.hand, queue=256)
    silent = False
    while True:
        coming = asyncio.ensure_future(anext(stream))
        while not (await asyncio.wait({coming}, timeout=_SILENT_S))[0]:
            if not silent:
                teller.line(
                    f"no points of the {wanted.hand} hand for {_SILENT_S:.0f} s: is fusion "
                    "running and the hand in view? `rhot top` shows it"
                )
            silent = True
        silent = False
        messages.append(coming.result())
