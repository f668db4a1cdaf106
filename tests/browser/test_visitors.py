"""Visitors of one page: each has a view of his own, at a desk or on a phone."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.rig_tables import Viewer
from rhot.messages import Marker
from rhot.messages.camera import SeenInPicture
from services.viewer.server import open_server
from testing.hand_stream import pose_at

pytestmark = pytest.mark.browser
DEADLINE_S = 60.0
WAIT = {"timeout": DEADLINE_S * 1e3}
DESK, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
TOKEN = "a-secret_of-16-or-more"
RIG = """
[rig]
name = "desk"
[[camera]]
name = "left"
[[camera]]
name = "right"
[hand.right.markers]
index_tip = "green"
thumb_tip = "blue"
[viewer]
port = 0
rate_hz = 4.0
"""
# The sheet of controls that a phone has, its handle, and what moves up with it.
SHEET = '.mantine-Paper-root[style*="position: fixed"]'
InBackground = Callable[[Callable[[threading.Event], None]], threading.Event]


@pytest.fixture
def viewer(page_of: Callable[..., str], tmp_path: Path) -> str:
    """The page of a rig that is not calibrated; its address."""
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    return page_of(tmp_path / "rig.toml")


@pytest.fixture
def bend(router: str, in_background: InBackground) -> list[float]:
    """A right hand and a camera's pictures on the bus; the hand is at the time in the list."""
    now = [0.0]
    jpeg = pytest.importorskip("cv2").imencode(".jpg", np.full((120, 160, 3), 80, np.uint8))[1]

    def publish(stop: threading.Event) -> None:
        with zenoh.open(client_config([router])) as session:
            seq = 0
            while not stop.wait(1 / 5):
                seq += 1
                stamp_ns = time.time_ns() - 30_000_000
                pose = msgspec.json.encode(pose_at(now[0], stamp_ns, seq))
                session.put(topics.POSE.key("desk", hand="right"), pose)
                found = Marker(
                    color="green", x_px=80.0, y_px=60.0, area_px=90.0, sigma_px=0.1, quality=1.0
                )
                seen = SeenInPicture(
                    stamp_ns=stamp_ns,
                    size_px=(160, 120),
                    markers=[found],
                    looked_for=["green", "blue"],
                    searched_px=(40, 30, 120, 90),
                )
                key = topics.PREVIEW.key("desk", camera="left")
                session.put(key, jpeg.tobytes(), attachment=msgspec.json.encode(seen))

    in_background(publish)
    return now


def choose(page: Any, label: str, option: str) -> None:
    page.get_by_label(label, exact=True).first.click()
    page.get_by_role("option", name=option, exact=True).first.click()


def degrees(page: Any, digit: str) -> list[str]:
    """What the table says of a digit's joints."""
    words: list[str] = page.locator("table tr", has_text=digit).first.inner_text().split()
    return words[1:]


def until(page: Any, condition: Callable[[], Any]) -> Any:
    deadline = time.monotonic() + DEADLINE_S
    while not (found := condition()) and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    assert found
    return found


def boxes(page: Any) -> list[tuple[str, float, float]]:
    """Name, top and bottom of what stands in the panel, from the top down."""
    found = {
        "card": page.get_by_text("programs of this rig do not run").first,
        "follows": page.get_by_text("what follows from it").first,
        "tabs": page.get_by_role("tab", name="Live"),
        "status": page.get_by_text("right hand: tracked").first,
        "trails": page.get_by_text("finger trails", exact=True),
        "pictures": page.get_by_text("camera pictures", exact=True),
        "angles": page.get_by_text("right hand: bend of its joints").first,
    }
    placed = []
    for name, one in found.items():
        # What is being brought up to date is nowhere for a moment.
        box = until(page, one.bounding_box)
        placed.append((name, box["y"], box["y"] + box["height"]))
    return placed


def nothing_overlaps_at_a_desk(page: Any) -> None:
    """The panel is beside the scene."""
    canvas = page.locator("canvas").first.bounding_box()
    left = page.get_by_role("tab", name="Live").bounding_box()["x"]
    assert canvas["x"] + canvas["width"] <= left
    assert canvas["width"] > 0.6 * DESK["width"]
    nothing_overlaps(page, DESK)


def nothing_overlaps_on_a_phone(page: Any) -> None:
    """The sheet is closed at first; opened, it leaves the upper half to the hand."""
    closed = until(page, lambda: page.locator(SHEET).bounding_box())
    until(page, lambda: page.locator(SHEET).bounding_box()["height"] < 80)
    assert closed["width"] == PHONE["width"]
    page.locator(SHEET).get_by_text("rhot: 1 problem").click()
    until(page, lambda: page.locator(SHEET).bounding_box()["height"] > 300)
    page.wait_for_timeout(500)
    assert page.locator(SHEET).bounding_box()["y"] >= 0.49 * PHONE["height"]
    nothing_overlaps(page, PHONE)


def nothing_overlaps(page: Any, size: dict[str, int]) -> None:
    """What stands in the panel stands below each other, within the window."""
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    assert "rig.json: no such file" in page.inner_text("body")
    for (name, _, bottom), (below, top, _) in itertools.pairwise(boxes(page)):
        assert bottom <= top + 1.0, f"{name} overlaps {below} at {size}"


def test_visitors_do_not_change_each_others_view_and_nothing_overlaps(
    chromium: Any, viewer: str, bend: list[float]
) -> None:
    asked: list[str] = []

    def visit(size: dict[str, int]) -> Any:
        page = chromium.new_context(viewport=size).new_page()
        page.set_default_timeout(DEADLINE_S * 1e3)
        page.on("request", lambda request: asked.append(request.url))
        page.on("websocket", lambda socket: asked.append(socket.url))
        page.goto(viewer)
        return page

    desk = visit(DESK)
    # The angles told are those that were sent: straight, then pinched.
    desk.get_by_text("right hand: tracked").wait_for(**WAIT)
    until(desk, lambda: degrees(desk, "index") == ["0°"] * 4)
    bend[0] = 0.5
    until(desk, lambda: degrees(desk, "index") == ["1°", "47°", "57°", "35°"])
    assert desk.title() == "rhot"
    desk.get_by_text("rhot: 1 problem").first.wait_for(**WAIT)
    nothing_overlaps_at_a_desk(desk)

    choose(desk, "camera pictures", "left")
    desk.locator("svg circle").first.wait_for(**WAIT)
    assert desk.locator("svg text", has_text="not in view: blue").count() == 1
    desk.get_by_label("finger trails").first.check()
    desk.get_by_role("tab", name="Plots").click()
    choose(desk, "plot", "joints: right index finger")
    desk.locator(".uplot canvas").wait_for(**WAIT)

    phone = visit(PHONE)
    until(phone, lambda: "rhot: 1 problem" in phone.inner_text("body"))
    nothing_overlaps_on_a_phone(phone)
    shows_nothing_of_the_desk(phone)
    # And what the phone chooses leaves the desk as it is.
    choose(phone, "camera pictures", "right")
    phone.get_by_text("waiting for the picture of right").wait_for(**WAIT)
    assert desk.locator(".uplot canvas").count() == 1
    desk.get_by_role("tab", name="Live").click()
    assert desk.get_by_label("camera pictures", exact=True).first.input_value() == "left"

    own = urlsplit(viewer).netloc
    beyond = [url for url in asked if urlsplit(url).scheme not in ("data", "blob")]
    assert {urlsplit(url).netloc for url in beyond} == {own}
    for page in (desk, phone):
        page.context.close()


def shows_nothing_of_the_desk(phone: Any) -> None:
    """No picture, no trails, no chart, and the first tab."""
    phone.get_by_label("camera pictures", exact=True).first.wait_for(**WAIT)
    assert phone.get_by_label("camera pictures", exact=True).first.input_value() == "none"
    assert not phone.get_by_label("finger trails").first.is_checked()
    assert phone.locator('img[src^="data:image/jpeg"]').count() == 0
    assert phone.locator(".uplot").count() == 0
    assert phone.get_by_role("tab", name="Live").get_attribute("aria-selected") == "true"


def test_a_browser_comes_in_with_the_token_only(chromium: Any) -> None:
    with open_server(Viewer(port=0, token=TOKEN)) as server:
        server.gui.add_html("for who has the token")
        address = f"http://127.0.0.1:{server.get_port()}"
        stranger = chromium.new_context().new_page()
        answer = stranger.goto(address)
        assert answer.status == 401
        assert "needs its token" in stranger.inner_text("body")
        page = chromium.new_context().new_page()
        page.goto(f"{address}/?token={TOKEN}")
        page.get_by_text("for who has the token").wait_for(**WAIT)
        # Again without it in the address: the browser has it.
        page.goto(address)
        page.get_by_text("for who has the token").wait_for(**WAIT)
        for one in (stranger, page):
            one.context.close()
