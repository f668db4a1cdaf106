"""What a visitor's tab is made of, and what it is brought up to date with. Pure.

A section is made once, with the service; each visitor opens it for himself. Everything of a visitor
is added to `client.gui` and `client.scene`: what is added to `server.gui` and `server.scene` all
visitors share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import viser

from rhot.watch.rig_state import StandingFault
from services.viewer.live.views import View


@dataclass(frozen=True)
class Seen:
    """The rig at one instant: now_s is monotonic, now_ns is CLOCK_REALTIME.

    starting has the programs that prepare themselves, as a person calls them.
    """

    view: View
    faults: Sequence[StandingFault]
    now_s: float
    now_ns: int
    starting: Sequence[str] = ()


class OpenSection(Protocol):
    """A section as one visitor has it open."""

    def update(self, seen: Seen) -> None:
        """Bring texts and switches up to date: called five times a second, on the service's loop.

        Must not block.
        """

    def close(self) -> None:
        """The visitor has gone: end tasks and subscriptions. His controls go by themselves."""


class Section(Protocol):
    """One tab of the page."""

    @property
    def title(self) -> str:
        """What stands on the tab, in plain words."""

    def open(self, client: viser.ClientHandle, tab: viser.GuiTabHandle) -> OpenSection:
        """Fill one visitor's tab: called on the service's loop, inside `with tab:`.

        viser calls what is registered with on_click() and on_update() from threads of its own: hand
        over with loop.call_soon_threadsafe().
        """


# Makes what stands above one visitor's tabs.
Head = Callable[[viser.ClientHandle], OpenSection]
