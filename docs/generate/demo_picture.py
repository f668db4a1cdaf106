"""`make picture`: docs/demo.png, the page of the live view while the demo's hand holds the cup.

The demo's scene is rendered and tracked as pictures, without haste: what the page shows then is one
instant of that result, sent to it again and again. So the picture is the same on a slow machine,
and in a browser without a graphics card. Needs Chromium and the extra `browser`.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.capture import read_lines
from rhot.messages import HandPoints, HandPose
from rhot.messages.objects import ObjectContacts, ObjectPose
from services.cli.live.working_copy import working_copy
from testing.loopback import free_endpoint

TARGET = Path(__file__).parents[1] / "demo.png"
# The scene is 1280 pixels wide, and the panel beside it 400.
_WIDTH, _HEIGHT, _SHARPER = 1680, 720, 1.5
# Hand and cup with what is around them, without the panel: most of this rig does not run.
_LEFT, _TOP, _RIGHT, _BOTTOM = 150, 120, 1040, 624
# The hand of seed 1 holds the cup from 2.3 s of the scene on, and has lifted it after 3.
_SECONDS = 4.5
# Without a graphics card the first picture of a page takes some seconds.
_DRAWN_MS, _PATIENCE_MS = 8_000, 120_000
_MAX_BYTES = 400_000
_FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
# Where the wheel brings the view nearer, px, and how far.
_HAND_PX, _NEARER = (600, 400), -250
M = TypeVar("M", HandPose, HandPoints, ObjectPose)
Shown = HandPose | HandPoints | ObjectPose | ObjectContacts


def main() -> None:
    """Render, track, show and photograph."""
    with tempfile.TemporaryDirectory() as folder, working_copy(Path(folder) / "rig") as config:
        capture, tracked = Path(folder) / "capture", Path(folder) / "tracked"
        wanted = ["--seconds", str(_SECONDS), "--seed", "1", "--out", str(capture)]
        _rhot("simulate", "grab", "--config", str(config), *wanted)
        _rhot("track", str(capture), "--out", str(tracked))
        with _page(config) as (endpoint, address), _sent(_instant(tracked), endpoint):
            _photograph(address)
    size = TARGET.stat().st_size
    if size > _MAX_BYTES:
        sys.exit(f"{TARGET} has {size} bytes, more than {_MAX_BYTES}")
    print(f"written: {TARGET}, {size} bytes")


def _rhot(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "services.cli", *words], check=True)


def _instant(tracked: Path) -> dict[str, Shown]:
    """Key -> message, of the instant at which most fingers hold the cup."""
    contacts = list(read_lines(tracked / "contacts.jsonl", ObjectContacts))
    held = [one for one in contacts if one.grasps]
    if not held:
        sys.exit("nothing is held in this scene")
    most = max(len(one.grasps[0].parts) for one in held)
    best = [one for one in held if len(one.grasps[0].parts) == most]
    chosen = best[len(best) // 2]
    found: dict[str, Shown] = {topics.CONTACTS.key("sim", object=chosen.object): chosen}

    def nearest(file: str, kind: type[M]) -> M:
        messages = read_lines(tracked / file, kind)
        return min(messages, key=lambda one: abs(one.stamp_ns - chosen.stamp_ns))

    found[topics.POSE.key("sim", hand="right")] = nearest("poses.jsonl", HandPose)
    found[topics.POINTS.key("sim", hand="right")] = nearest("points.jsonl", HandPoints)
    found[topics.OBJECT.key("sim", object=chosen.object)] = nearest("objects.jsonl", ObjectPose)
    return found


@contextmanager
def _page(config: Path) -> Iterator[tuple[str, str]]:
    """A router and a viewer: the endpoint and the page's address."""
    endpoint = free_endpoint()
    python, common = [sys.executable, "-m"], ["--config", str(config)]
    router = [*python, "services.cli", "router", *common, "--listen", endpoint]
    viewer = [*python, "services.viewer", *common, "--connect", endpoint]
    with (
        subprocess.Popen(router, stdout=subprocess.DEVNULL) as routing,
        subprocess.Popen(viewer, stdout=subprocess.PIPE, text=True) as viewing,
    ):
        try:
            assert viewing.stdout is not None
            line = next(line for line in viewing.stdout if "live view at" in line)
            yield endpoint, line.split("live view at ")[1].strip()
        finally:
            for process in (viewing, routing):
                process.send_signal(signal.SIGINT)


@contextmanager
def _sent(messages: dict[str, Shown], endpoint: str) -> Iterator[None]:
    """The messages, with the time that it is, ten times a second."""
    over = threading.Event()

    def send() -> None:
        with zenoh.open(client_config([endpoint])) as session:
            while not over.wait(0.1):
                for key, message in messages.items():
                    now = msgspec.structs.replace(message, stamp_ns=time.time_ns())
                    session.put(key, msgspec.json.encode(now))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _photograph(address: str) -> None:
    # Not above: it is of the extra `browser`.
    from playwright.sync_api import FloatRect, sync_playwright

    chromium = os.environ.get("RHOT_CHROMIUM") or shutil.which("chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=list(_FLAGS))
        page = browser.new_page(
            viewport={"width": _WIDTH, "height": _HEIGHT}, device_scale_factor=_SHARPER
        )
        page.goto(address)
        page.get_by_text("hand holds cup").wait_for(timeout=_PATIENCE_MS)
        # The page's note that it is drawn without a graphics card is of this machine, and most of
        # the rig does not run.
        page.add_style_tag(content=".mantine-Notifications-root { display: none }")
        page.mouse.move(*_HAND_PX)
        page.mouse.wheel(0, _NEARER)
        page.wait_for_timeout(_DRAWN_MS)
        shown = FloatRect(x=_LEFT, y=_TOP, width=_RIGHT - _LEFT, height=_BOTTOM - _TOP)
        page.screenshot(path=TARGET, clip=shown, timeout=_PATIENCE_MS)
        browser.close()


if __name__ == "__main__":
    main()
