"""The running viewer: a real router, a real viser server, and a browser made of a websocket."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import Bus
from rhot.files.config import RigConfig
from rhot.files.rig_tables import RigTable
from rhot.messages.camera import SeenInPicture
from services.viewer.service import serve
from testing.waiting import until

Make = Callable[..., Any]
Message = tuple[str, dict[str, Any]]
HELD = ("thumb", "index")
SEEN = SeenInPicture(
    stamp_ns=1, size_px=(640, 480), markers=[], looked_for=["green"], searched_px=None
)


class MarkerNoMore(msgspec.Struct):
    """What goes with a picture, and is not what it should be."""

    markers: str


JPEG = b"\xff\xd8\xff\xe0picture"


def hears(words: str) -> Message:
    """A text of the panel that contains these words."""
    return "GuiUpdateMessage", {"updates": lambda u: words in u.get("content", "")}


# Every kind of message that is published, as drawn and as text.
DRAWN: tuple[Message, ...] = (
    ("BatchedMeshesMessage", {"name": "/hands/right/joints"}),
    ("BatchedMeshesMessage", {"name": "/hands/right/points"}),
    ("SetPositionMessage", {"name": "/objects/cup"}),
    ("CylinderMessage", {"name": "/objects/cup/shape"}),
    ("SetSceneNodeVisibilityMessage", {"name": "/touches/tips", "visible": True}),
    ("SetSceneNodeVisibilityMessage", {"name": "/touches/points", "visible": True}),
    hears("object cup: tracked"),
    hears("right hand holds cup (thumb, index)"),
    hears("right hand: tracked"),
    hears("points of the right hand"),
    hears("57&deg;"),
)
# Nothing comes any more: the hand is hidden, and said to be missing.
MISSING: tuple[Message, ...] = (
    ("SetSceneNodeVisibilityMessage", {"name": "/hands/right/joints", "visible": False}),
    hears("right hand: waiting for"),
    ("SetSceneNodeVisibilityMessage", {"name": "/objects/cup", "visible": False}),
    ("SetSceneNodeVisibilityMessage", {"name": "/touches/tips", "visible": False}),
    hears("object cup: nothing has come"),
)


@pytest.fixture
def send_everything(
    make_pose: Make, make_points: Make, make_object: Make, make_contacts: Make, make_health: Make
) -> Callable[[Bus], Callable[[], None]]:
    """A function of the bus that sends one message of every kind, and garbage on their keys."""

    def prepare(bus: Bus) -> Callable[[], None]:
        messages = (
            (bus.publisher(topics.POSE, hand="right"), make_pose()),
            (bus.publisher(topics.POINTS, hand="right"), make_points("index_tip")),
            (bus.publisher(topics.OBJECT, object="cup"), make_object()),
            (bus.publisher(topics.CONTACTS, object="cup"), make_contacts("index", held=HELD)),
            (bus.publisher(topics.HEALTH, service="fusion", instance="main"), make_health()),
        )

        def send() -> None:
            for publisher, message in messages:
                publisher.put(message)
                bus.put_raw(publisher.key, b'\xff{"garbage"')

        return send

    return prepare


async def test_what_is_published_is_drawn_and_told(
    running: Callable,
    config: RigConfig,
    browse: Make,
    send_everything: Callable[[Bus], Callable[[], None]],
    sending: Callable,
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        await until(lambda: service.state == "running")
        send = send_everything(bus)
        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        with sending(send):
            for kind, fields in DRAWN:
                await asyncio.to_thread(browser.wait_for, kind, **fields)
            await until(lambda: sum(stats.rejected for stats in service.bus.streams) >= 5)
        browser.forget()
        for kind, fields in MISSING:
            await asyncio.to_thread(browser.wait_for, kind, **fields)


async def test_uncalibrated_cameras_are_left_out_with_a_note(
    running: Callable, config: RigConfig, browse: Make
) -> None:
    async with running("viewer", serve, config) as (service, _):
        await until(lambda: service.state == "running")
        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        status = await asyncio.to_thread(
            browser.wait_for,
            "GuiHtmlMessage",
            props=lambda props: "right hand: waiting for" in props["content"],
        )
        assert "camera left is not drawn: rig.json: no such file" in status["props"]["content"]


async def test_nothing_is_done_while_nobody_looks(
    running: Callable, config: RigConfig, browse: Make, make_pose: Make
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        await until(lambda: service.state == "running")
        publisher = bus.publisher(topics.POSE, hand="right")
        assert service.bus.streams == []
        assert not publisher.wanted
        for _ in range(2):
            browser = await asyncio.to_thread(browse, int(service.values["port"]))
            await until(lambda: publisher.wanted)
            # Poses, points, objects, contacts, captions, and health twice: rates, what is wrong.
            await until(lambda: len(service.bus.streams) == 7)
            await asyncio.to_thread(browser.close)
            await until(lambda: not publisher.wanted)
            assert service.bus.streams == []


async def test_pictures_are_asked_for_by_who_looks_and_shown_to_nobody_else(
    running: Callable, config: RigConfig, browse: Make, sending: Callable
) -> None:
    async with running("viewer", serve, config) as (service, bus):
        await until(lambda: service.state == "running")
        left, right = (bus.publisher(topics.PREVIEW, camera=name) for name in ("left", "right"))
        port = int(service.values["port"])
        looks, other = [await asyncio.to_thread(browse, port) for _ in range(2)]
        choices = [
            await asyncio.to_thread(
                browser.wait_for,
                "GuiDropdownMessage",
                props=lambda p: p["label"] == "camera pictures",
            )
            for browser in (looks, other)
        ]
        assert choices[0]["props"]["options"] == ["none", "left", "right", "all"]
        assert not left.wanted
        looks.click(choices[0]["uuid"], "left")
        await until(lambda: left.wanted)
        assert not right.wanted, "of cameras that nobody looks at nothing is asked"
        other.click(choices[1]["uuid"], "right")

        def send() -> None:
            left.put_bytes(JPEG, SEEN)
            bus.put_raw(left.key, JPEG)
            right.put_bytes(b"<script>")
            right.put_bytes(JPEG, MarkerNoMore(markers="<script>"))

        with sending(send):
            shown = await asyncio.to_thread(
                looks.wait_for,
                "GuiUpdateMessage",
                updates=lambda u: "data:image/jpeg" in u.get("content", ""),
            )
            assert "left<div" in shown["updates"]["content"]
            await asyncio.to_thread(
                looks.wait_for,
                "GuiUpdateMessage",
                updates=lambda u: "green</text></svg>" in u.get("content", ""),
            )
            await until(lambda: service.errors >= 2)
        assert "no JPEG" in service.last_error or "cannot be read" in service.last_error
        # All that the other was told until now: nothing of the first one's pictures.
        other.click(choices[1]["uuid"], "none")
        await asyncio.to_thread(
            other.wait_for, "GuiUpdateMessage", updates=lambda u: u.get("visible") is False
        )
        assert not other.heard_of("data:image/jpeg")
        await until(lambda: not right.wanted)
        await asyncio.to_thread(looks.close)
        await until(lambda: not left.wanted)


async def test_trails_are_one_visitors_alone(
    running: Callable, config: RigConfig, browse: Make
) -> None:
    async with running("viewer", serve, config) as (service, _):
        await until(lambda: service.state == "running")
        port = int(service.values["port"])
        looks, other = [await asyncio.to_thread(browse, port) for _ in range(2)]
        for browser in (looks, other):
            shown = await asyncio.to_thread(
                browser.wait_for, "SetSceneNodeVisibilityMessage", name="/trails"
            )
            assert shown["visible"] is False
        switch = await asyncio.to_thread(
            looks.wait_for, "GuiCheckboxMessage", props=lambda p: p["label"] == "finger trails"
        )
        looks.click(switch["uuid"], True)
        await asyncio.to_thread(
            looks.wait_for, "SetSceneNodeVisibilityMessage", name="/trails", visible=True
        )
        # What is drawn for all: a trail that was waited for, and to the other still hidden.
        await asyncio.to_thread(other.wait_for, "GuiUpdateMessage")
        assert not other.heard_of("/trails", "SetSceneNodeVisibilityMessage", visible=True)


async def test_the_pages_of_two_rigs_lead_to_each_other(
    running: Callable, config: RigConfig, browse: Make
) -> None:
    bench = msgspec.structs.replace(config, rig=RigTable(name="bench"))
    async with running("viewer", serve, config) as (service, _):
        await until(lambda: service.state == "running")
        browser = await asyncio.to_thread(browse, int(service.values["port"]))
        async with running("viewer", serve, bench, instance="bench") as (other, _):
            await until(lambda: other.state == "running")
            address = f"http://127.0.0.1:{other.values['port']}"
            kind, fields = hears(f'<a href="{address}"')
            await asyncio.to_thread(browser.wait_for, kind, **fields)
        kind, fields = "GuiUpdateMessage", {"updates": lambda u: u.get("visible") is False}
        browser.forget()
        await asyncio.to_thread(browser.wait_for, kind, **fields)
