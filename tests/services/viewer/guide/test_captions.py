"""Captions come to every browser, change there, and go when nobody says them any more."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.files.rig_tables import Viewer
from rhot.messages import Caption
from services.viewer.guide import captions
from services.viewer.guide.captions import Captions
from services.viewer.server import open_server


async def test_a_caption_is_shown_changed_and_taken_away(
    router: str, browse: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(captions, "_OVER_S", 1.0)
    async with open_bus("desk", [router]) as ours, open_bus("desk", [router]) as theirs:
        with open_server(Viewer(port=0)) as server:
            browser = await asyncio.to_thread(browse, server.get_port())
            while not server.get_clients():
                await asyncio.sleep(0.02)
            following = asyncio.create_task(Captions(server).follow(ours))
            publisher = theirs.publisher(topics.CAPTION)
            said = [
                Caption(title="A hand", text="<b>six</b> dots", step=1, steps=4),
                Caption(title="A hand", text="run `rhot demo`", step=1, steps=4),
            ]

            async def heard(type_: str, **fields: Any) -> dict[str, Any]:
                return await asyncio.to_thread(browser.wait_for, type_, **fields)

            waiting = asyncio.create_task(heard("NotificationShowMessage"))
            while not waiting.done():
                publisher.put(said[0])
                await asyncio.sleep(0.1)
            shown = await waiting
            assert shown["props"]["title"] == "1/4  A hand"
            assert shown["props"]["body"] == "<b>six</b> dots"
            publisher.put(said[1])
            await heard(
                "NotificationUpdateMessage",
                props=lambda new: new["body"] == "run \u2018rhot demo\u2019",
            )
            # Nobody says anything more.
            await heard("RemoveNotificationMessage")
            following.cancel()
