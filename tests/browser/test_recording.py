"""Recording and replay as a person operates them: real processes, a real browser."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from rhot.files.config import load_rig
from services.recorder.reader import summarize
from testing.hand_stream import pose_at
from testing.recorded_hand import write_hand

pytestmark = pytest.mark.browser
# Chromium without a graphics card shares its cores with everything else.
DEADLINE_S = 90.0


def until(page: Any, condition: Callable[[], object], what: str) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline_s, f"never: {what}\n{page.inner_text('body')}"
        page.wait_for_timeout(200)


def shows(page: Any, text: str) -> None:
    until(page, lambda: text in page.inner_text("body"), text)


def open_page(chromium: Any, address: str) -> Any:
    page = chromium.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(DEADLINE_S * 1e3)
    page.goto(address)
    page.get_by_role("tab", name="Recording").click()
    return page


def picture(page: Any) -> bytes:
    """The 3D view without the panel."""
    clip = {"x": 0, "y": 0, "width": 700, "height": 800}
    return bytes(page.screenshot(clip=clip, timeout=DEADLINE_S * 1e3))


@pytest.fixture
def rig(repository: Path, tmp_path: Path) -> Path:
    """The simulated rig's file in a folder of its own, with one recording."""
    shutil.copytree(repository / "config" / "calibration", tmp_path / "calibration")
    text = (repository / "config" / "sim.toml").read_text()
    path = tmp_path / "rig.toml"
    path.write_text(f"{text}\n[viewer]\nport = 0\n")
    (tmp_path / "recordings").mkdir()
    # Long enough for a browser that starts slowly: what has ended cannot be paused.
    write_hand(tmp_path / "recordings" / "pinch.mcap", load_rig(path), 240.0)
    return path


@pytest.fixture
def services(page_of: Callable[..., str], rig: Path) -> str:
    """Recorder and viewer as `rhot up` starts them; the page's address."""
    return page_of(rig, "recorder --on-request")


def test_a_person_records_and_replays(services: str, rig: Path, router: str, chromium: Any) -> None:
    live = open_page(chromium, services)
    shows(live, "Nothing is being recorded")
    live.get_by_role("button", name="Record", exact=True).click()
    shows(live, "recording")
    with zenoh.open(client_config([router])) as session:

        def send() -> bool:
            pose = msgspec.json.encode(pose_at(0.0, time.time_ns(), 1))
            session.put(topics.POSE.key(load_rig(rig).rig.name, hand="right"), pose)
            return ", 0 messages" not in live.inner_text("body")

        until(live, send, "messages that are recorded")
    live.get_by_role("button", name="Stop recording").click()
    shows(live, "Nothing is being recorded")
    folder = rig.parent / "recordings"
    (made,) = (path for path in folder.glob("*.mcap") if path.name != "pinch.mcap")
    assert summarize(made).messages >= 1

    until(live, lambda: made.name in _chosen(live), "the new recording is chosen")
    live.get_by_role("combobox", name="recording").click()
    live.get_by_role("option").filter(has_text="pinch.mcap").click()
    until(live, lambda: "pinch.mcap" in _chosen(live), "the other one is chosen")
    live.get_by_role("button", name="Replay", exact=True).click()
    with live.expect_popup() as opened:
        live.get_by_role("link", name="See it").click()
    replay = opened.value
    replay.set_default_timeout(DEADLINE_S * 1e3)
    replay.get_by_role("tab", name="Recording").click()
    replay.get_by_role("button", name="Pause").click()
    shows(replay, "paused")
    still = picture(replay)
    replay.get_by_role("button", name="Play", exact=True).click()
    shows(replay, "playing")
    until(replay, lambda: picture(replay) != still, "a hand that moves")
    live.get_by_role("button", name="Close").click()
    until(live, lambda: not live.get_by_role("link", name="See it").is_visible(), "closed")


def _chosen(page: Any) -> str:
    """What stands in the page's inputs."""
    inputs = "[...document.querySelectorAll('input')].map(one => one.value).join(' ')"
    return str(page.evaluate(inputs))


def test_a_recording_is_shown_without_a_rig(rig: Path, tmp_path: Path, chromium: Any) -> None:
    file = shutil.copy(rig.parent / "recordings" / "pinch.mcap", tmp_path / "else.mcap")
    argv = [sys.executable, "-m", "services.cli", "replay", str(file), "--view", "--loop"]
    with subprocess.Popen(
        argv, cwd=tmp_path / "recordings", stderr=subprocess.PIPE, text=True
    ) as command:
        assert command.stderr is not None
        line = next(line for line in command.stderr if "Ctrl-C ends it" in line)
        page = open_page(chromium, line.split(" at ")[1].split(";")[0])
        shows(page, "This page shows a recording")
        shows(page, "else.mcap")
        still = picture(page)
        until(page, lambda: picture(page) != still, "a hand that moves")
        command.send_signal(signal.SIGINT)
        assert command.wait(30.0) == 0
