"""Replays a recording onto a bus, under the name of the bus's rig."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

from rhot.bus.bus import Bus
from services.recorder.reader import Record
from services.recorder.sources.playback import Playback, Publish


async def replay(
    bus: Bus,
    path: Path,
    rate: float = 1.0,
    *,
    loop: bool = False,
    only: Collection[str] = (),
    window_ns: tuple[int, int] | None = None,
    report: Callable[[Record], None] | None = None,
) -> int:
    """Publish a recording; returns how many messages were sent.

    rate 1 is real time, 2 twice as fast, 0 as fast as possible. loop begins again at the end, for
    ever. only keeps the named topics (`camera/markers`; empty: all), window_ns what arrived then.
    report is called with each record once it is sent, in the player's thread. Raises CaptureError.
    """
    publish = publishing(bus, patient=True)
    playback = Playback(
        path, bus.rig, publish, rate=rate, loop=loop, only=only, window_ns=window_ns, report=report
    )
    return await playback.run()


def publishing(bus: Bus, *, patient: bool) -> Publish:
    """What a Playback publishes with.

    patient: a line that is full is waited for, and nothing is lost (15 of 2944 messages at 1x on a
    machine that was four times overloaded; the plain way as many). Else it loses messages, as it
    does live ones, and holds nobody up.
    """

    def publish(key: str, payload: bytes, encoding: str) -> None:
        bus.put_raw(key, payload, encoding, wait=patient)

    return publish
