"""Calibrating colours as a new user does: real viewer and tracker processes, a real browser, clicks
on painted fingers.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.calibration import load_colors
from rhot.messages import MarkerFrame, Session
from rhot.messages.simulator import SimFrame
from testing.synthetic_images import PAINTS, Tip, clean, frame_of, noisy

pytestmark = pytest.mark.browser
DEADLINE_S = 60.0
SIZE = (320, 240)
WAIT = {"timeout": DEADLINE_S * 1e3}
InBackground = Callable[[Callable[[threading.Event], None]], threading.Event]
RIG = """
[rig]
name = "desk"
[[camera]]
name = "left"
source = "simulator"
size_px = [320, 240]
[hand.right.markers]
index_tip = "green"
thumb_tip = "blue"
[viewer]
port = 0
"""


@pytest.fixture(scope="module")
def shot() -> np.ndarray:
    """What the camera sees: a green and a blue finger tip."""
    tips = [
        Tip("green", 120.0, 120.0, width_px=20.0, length_px=24.0),
        Tip("blue", 200.0, 110.0, width_px=20.0, length_px=24.0),
    ]
    return clean(tips, SIZE)[0]


@pytest.fixture
def camera(router: str, shot: np.ndarray, in_background: InBackground) -> list[MarkerFrame]:
    """The camera, the master that started the session, and what the tracker sends."""
    seen = list[MarkerFrame]()

    def answer(query: zenoh.Query) -> None:
        with query:
            session = Session(running=True, start_ns=1)
            query.reply(topics.SESSION.key("desk"), msgspec.json.encode(session))

    def take(sample: zenoh.Sample) -> None:
        seen.append(msgspec.json.decode(sample.payload.to_bytes(), type=MarkerFrame))

    def film(stop: threading.Event) -> None:
        image = frame_of(noisy(shot, 4.0, 1), 0, "i420").image.tobytes()
        key = topics.SIM_FRAME.key("desk", camera="left")
        with zenoh.open(client_config([router])) as session:
            session.declare_queryable(topics.SESSION.key("desk"), answer)
            session.declare_subscriber(topics.MARKERS.key("desk", camera="left"), take)
            for seq in itertools.count():
                header = SimFrame(
                    camera="left",
                    seq=seq,
                    stamp_ns=time.time_ns(),
                    row_time_ns=1e4,
                    size_px=SIZE,
                    clock_skew_ns=0,
                )
                # No two pictures of a camera are the same.
                picture = image[:-1] + bytes([seq % 256])
                session.put(key, picture, attachment=msgspec.json.encode(header))
                if stop.wait(1 / 15):
                    return

    in_background(film)
    return seen


@pytest.fixture
def page_url(page_of: Callable[..., str], tmp_path: Path) -> str:
    """The page beside a tracker without any calibration; its address."""
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    return page_of(tmp_path / "rig.toml", "pi_tracker --camera left")


def pixels(page: Any) -> np.ndarray:
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    return np.array(image.open(BytesIO(page.screenshot())).convert("RGB")).astype(int)


def where(page: Any, paint: str) -> tuple[float, float] | None:
    """The middle of a paint in the page, None if it is not there.

    The panel on the right is left out.
    """
    rgb = pixels(page)[:, :-400]
    near = np.abs(rgb - np.array(PAINTS[paint][::-1])).max(axis=2) < 45
    rows, columns = np.nonzero(near)
    return (float(np.median(columns)), float(np.median(rows))) if len(rows) > 150 else None


def settled(page: Any, paint: str) -> tuple[float, float]:
    """The middle of a paint once it stays where it is: the view is turned to a new picture."""
    before: tuple[float, float] | None = None

    def stays() -> tuple[float, float] | None:
        nonlocal before
        last, before = before, where(page, paint)
        page.wait_for_timeout(200)
        still = last and before and abs(last[0] - before[0]) + abs(last[1] - before[1]) < 2.0
        return before if still else None

    found: tuple[float, float] = until(page, stays)
    return found


def until(page: Any, condition: Any) -> Any:
    deadline = time.monotonic() + DEADLINE_S
    while not (found := condition()) and time.monotonic() < deadline:
        page.wait_for_timeout(100)
    assert found
    return found


def is_outlined(page: Any, middle: tuple[float, float]) -> bool:
    """Whether a white line surrounds the marker: in the grey about it nothing is brighter than 165,
    and pictures are compressed, which takes a line of one pixel down to 185 in places.
    """
    x, y = (round(v) for v in middle)
    white = pixels(page)[y - 60 : y + 60, x - 60 : x + 60].min(axis=2) > 180
    rows, columns = np.nonzero(white)
    return bool(white.sum() > 100 and np.ptp(rows) > 30 and np.ptp(columns) > 30)


def open_colours(page: Any, url: str) -> None:
    """Show the picture to click: the second step of the tab."""
    page.goto(url)
    tab = page.get_by_role("tab", name="Calibration")
    tab.wait_for(**WAIT)
    tab.click()
    page.get_by_role("button", name="next", exact=True).click()


def click_markers(page: Any) -> tuple[float, float]:
    """Click beside the green marker, then on both; returns where the green one is."""
    # Grey is no paint, and says so.
    green = settled(page, "green")
    page.mouse.click(green[0], green[1] - 180)
    page.get_by_text("is on something grey").wait_for(**WAIT)

    page.mouse.click(*settled(page, "blue"))
    page.get_by_text("1 of 2 colours clicked").wait_for(**WAIT)
    page.get_by_text("click the middle of the green marker").wait_for(**WAIT)
    page.mouse.click(*green)
    page.get_by_text("2 of 2 colours clicked").wait_for(**WAIT)
    return green


def set_green_hue(page: Any, low: int, high: int, expected_low: int) -> None:
    """Set the hue of the green range with the sliders, which show expected_low before."""
    hue_from, hue_to = page.locator("input[type=text]").all()[-2:]
    assert int(hue_from.input_value()) == expected_low
    for box, value in ((hue_from, str(low)), (hue_to, str(high))):
        box.fill(value)
        box.press("Enter")
    page.get_by_text("set by hand: green").wait_for(**WAIT)
    page.get_by_text("not applied yet").wait_for(**WAIT)


def test_from_the_first_click_to_applied_ranges(
    chromium: Any, page_url: str, camera: list[MarkerFrame], tmp_path: Path
) -> None:
    page = chromium.new_page(viewport={"width": 1200, "height": 800})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    open_colours(page, page_url)
    page.get_by_text("click the middle of the blue marker").wait_for(**WAIT)
    page.get_by_text("still missing: blue, green").wait_for(**WAIT)
    apply = page.get_by_role("button", name="apply")
    assert apply.is_disabled()

    green = click_markers(page)
    assert page.locator("table tr", has_text="green").last.inner_text().count("d'") == 2

    assert not any(frame.markers for frame in camera)
    apply.click()
    page.get_by_text("applied on camera left and saved on its machine").wait_for(**WAIT)
    calibrated = load_colors(tmp_path / "calibration", "left")
    assert set(calibrated.colors) == {"green", "blue"}
    until(page, lambda: {marker.color for marker in camera[-1].markers} == {"green", "blue"})
    page.get_by_text("This camera is done.").wait_for(**WAIT)
    found = {marker.color: marker for marker in camera[-1].markers}
    assert abs(found["green"].x_px - 120.0) < 6.0
    assert abs(found["blue"].x_px - 200.0) < 6.0

    # Masks are drawn over the markers, the chosen colour's outlined in white.
    until(page, lambda: is_outlined(page, green))
    page.screenshot(path=tmp_path / "calibrated.png")

    # By hand: a range that takes nothing green, and the tracker no longer does.
    set_green_hue(page, 0, 9, expected_low=calibrated.colors["green"].hsv_low[0])
    apply.click()
    until(page, lambda: [marker.color for marker in camera[-1].markers] == ["blue"])
    by_hand = load_colors(tmp_path / "calibration", "left")
    assert (by_hand.colors["green"].hsv_low[0], by_hand.colors["green"].hsv_high[0]) == (0, 9)
    assert by_hand.inputs["by_hand"] == ["green"]

    # And back to the rig.
    page.get_by_role("button", name="back", exact=True).click()
    until(page, lambda: where(page, "green") is None)
    assert errors == []
    page.close()
