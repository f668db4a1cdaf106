"""The pages of the rigs that this process shows, so that each of them leads to the others.

A token is told only to who has given it already: a page with another one is linked without it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec

from rhot.files.rig_tables import Viewer
from rhot.files.viewer_access import page_address
from rhot.process.rigs.context import PLACE


@dataclass(frozen=True)
class RigPage:
    """Where the page of a rig is: its [viewer] table, and the port that it got.

    hostname is this machine's, for a page that listens at all its addresses.
    """

    rig: str
    table: Viewer
    port: int
    hostname: str = ""

    def address(self, token: str) -> str:
        """What to open in a browser, for somebody who knows this token."""
        known = self.table if self.table.token == token else _without_token(self.table)
        return page_address(known, self.port, self.hostname)


def at_its_place(table: Viewer) -> Viewer:
    """The table of one of several rigs: a port that none of them chose is each one's own.

    Whichever started first would have the first rig's else, another one every time.
    """
    if table.port != Viewer().port:
        return table
    return msgspec.structs.replace(table, port=table.port + PLACE.get())


_open: dict[str, RigPage] = {}


@contextlib.contextmanager
def announced(page: RigPage) -> Iterator[None]:
    """Within the block the other pages lead to this one."""
    _open[page.rig] = page
    try:
        yield
    finally:
        _open.pop(page.rig, None)


def others(page: RigPage) -> list[tuple[str, str]]:
    """Name and address of every other rig's page, by name."""
    return [
        (rig, other.address(page.table.token))
        for rig, other in sorted(_open.items())
        if rig != page.rig
    ]


def _without_token(table: Viewer) -> Viewer:
    return msgspec.structs.replace(table, token="")
