"""A headless Chromium, where there is one, and publishers that run beside it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from rhot.process.lifecycle import EXIT_AGAIN, EXIT_OK

# A service that is told to end and has not by then hangs, also on a busy machine.
_END_S = 30.0
_LAST_LINES = 30

# Software rendering, and nothing that talks to anybody.
FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)


# Not for the whole session: while playwright runs, no other test can have an event loop.
@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A playwright browser; skips without playwright or Chromium."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed; pip install playwright"
    )
    names = ("chromium", "chromium-browser", "google-chrome")
    path = os.environ.get("RHOT_CHROMIUM") or next(
        (found for name in names if (found := shutil.which(name))), None
    )
    if path is None:
        pytest.skip("no Chromium found; apt-get install chromium, or set RHOT_CHROMIUM to its path")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture
def in_background() -> Iterator[Callable[[Callable[[threading.Event], None]], threading.Event]]:
    """Run functions in threads; each ends when the event it was given is set.

    The event is returned, and set at the end of the test.
    """
    running: list[tuple[threading.Thread, threading.Event]] = []

    def start(function: Callable[[threading.Event], None]) -> threading.Event:
        stop = threading.Event()
        thread = threading.Thread(target=function, args=(stop,))
        thread.start()
        running.append((thread, stop))
        return stop

    yield start
    for thread, stop in running:
        stop.set()
        thread.join()


@pytest.fixture
def page_of(router: str, repository: Path, tmp_path: Path) -> Iterator[Callable[..., str]]:
    """`page_of(rig_toml, *words)` starts a viewer, and beside it a service for each of words, which
    are its name and options as one string; the page's address. They must end well.
    """
    started: list[_Started] = []

    def start(rig: Path, *beside: str) -> str:
        for words in (*beside, "viewer"):
            service, *options = words.split()
            command = [sys.executable, "-m", f"services.{service}", *options]
            # Not a pipe that nobody reads: who fills it waits for ever.
            log = tmp_path / f"{len(started)}_{service}.log"
            with log.open("wb") as output:
                process = subprocess.Popen(
                    [*command, "--config", str(rig), "--connect", router],
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    cwd=repository,
                    env={**os.environ, "OMP_NUM_THREADS": "1"},
                )
            started.append(_Started(words, process, log))
        return _address(started[-1])

    yield start
    for one in started:
        one.process.terminate()
    wrong = [said for one in started if (said := one.ended_wrongly())]
    assert not wrong, "\n\n".join(wrong)


@dataclass(frozen=True)
class _Started:
    """A service's process, and the file that it writes its log to."""

    words: str
    process: subprocess.Popen[bytes]
    log: Path

    def ended_wrongly(self) -> str:
        """How it ended, with the end of its log, unless it ended well; it has ended now."""
        try:
            code = self.process.wait(timeout=_END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return self.told(f"did not end in {_END_S:.0f} s")
        # A service ends by itself with a new calibration, to be started again; perhaps just now.
        return "" if code in (EXIT_OK, EXIT_AGAIN) else self.told(f"ended with code {code}")

    def told(self, what: str) -> str:
        """What it did, and the end of its log."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").splitlines()
        return "\n".join([f"{self.words} {what}; its log ends:", *lines[-_LAST_LINES:]])


def _address(viewer: _Started) -> str:
    """Where a viewer's page is, once it says so."""
    while viewer.process.poll() is None:
        for line in viewer.log.read_text(encoding="utf-8").splitlines():
            if "live view at " in line:
                return line.split("live view at ")[1].split('"')[0].strip()
        time.sleep(0.05)
    pytest.fail(viewer.told(f"ended with code {viewer.process.returncode}"))
