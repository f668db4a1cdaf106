"""Each browser has a visit of its own, from its coming to its going."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from rhot.files.rig_tables import Viewer
from services.viewer.live.model import ViewModel
from services.viewer.server import open_server
from services.viewer.visits.layer import Layer
from services.viewer.visits.section import Seen
from services.viewer.visits.visits import Visits
from testing.waiting import until

DEADLINE_S = 60.0
SEEN = Seen(ViewModel().view(0.0), [], 0.0, 0)


class Noting:
    """A section that notes what is done with it, and counts its updates in the visitor's tab."""

    def __init__(self, title: str, notes: list[str]) -> None:
        self.title, self.notes = title, notes

    def open(self, client: Any, _tab: Any) -> NotingTab:
        self.notes.append(f"{self.title} opened")
        return NotingTab(self, client)


class NotingTab:
    def __init__(self, section: Noting, client: Any) -> None:
        self.section, self.updates = section, 0
        self.text = client.gui.add_html(f"{section.title} of {client.client_id}")

    def update(self, _seen: Seen) -> None:
        self.updates += 1
        self.text.content = f"{self.section.title} updated {self.updates}"

    def close(self) -> None:
        self.section.notes.append(f"{self.section.title} closed")


async def test_every_browser_has_its_own_tabs(browse: Callable[..., Any]) -> None:
    notes: list[str] = []

    def head(client: Any) -> NotingTab:
        return Noting("Head", notes).open(client, None)

    with open_server(Viewer(port=0)) as server:
        visits = Visits(server, head, [Noting("Live", notes), Noting("Recording", notes)])
        assert not visits.anybody.is_set()
        first = await asyncio.to_thread(browse, server.get_port())
        await asyncio.wait_for(visits.anybody.wait(), DEADLINE_S)
        second = await asyncio.to_thread(browse, server.get_port())
        await until(lambda: len(visits) == 2)
        own = [
            await asyncio.to_thread(
                browser.wait_for, "GuiHtmlMessage", props=lambda p: "Live of" in p["content"]
            )
            for browser in (first, second)
        ]
        visits.update(SEEN)
        for browser, theirs in ((first, own[1]), (second, own[0])):
            await asyncio.to_thread(
                browser.wait_for,
                "GuiUpdateMessage",
                updates=lambda u: u.get("content") == "Recording updated 1",
            )
            assert browser.heard_of("['Live', 'Recording']")
            assert not browser.heard_of(theirs["uuid"])
        await asyncio.to_thread(first.close)
        await until(lambda: len(visits) == 1)
        assert visits.anybody.is_set()
        visits.close()
        assert not visits.anybody.is_set()
    assert sorted(notes) == sorted(
        2
        * [
            f"{name} {what}"
            for name in ("Head", "Live", "Recording")
            for what in ("opened", "closed")
        ]
    )


async def test_a_layer_is_wanted_while_one_visitor_shows_it(browse: Callable[..., Any]) -> None:
    layer = Layer("/trails")
    with open_server(Viewer(port=0)) as server:
        browsers = [await asyncio.to_thread(browse, server.get_port()) for _ in range(2)]
        await until(lambda: len(server.get_clients()) == 2)
        first, second = server.get_clients().values()
        for client in (first, second):
            layer.show(client, False)
        assert not layer.wanted
        layer.show(first, True)
        assert layer.wanted
        heard = await asyncio.to_thread(
            browsers[0].wait_for, "SetSceneNodeVisibilityMessage", name="/trails", visible=True
        )
        assert heard["name"] == "/trails"
        layer.forget(first)
        assert not layer.wanted
        with pytest.raises(TimeoutError):
            await asyncio.to_thread(
                browsers[1].wait_for,
                "SetSceneNodeVisibilityMessage",
                0.5,
                name="/trails",
                visible=True,
            )
