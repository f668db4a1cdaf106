"""A headless Chromium, where there is one, and publishers that run beside it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from rhot.process.lifecycle import EXIT_AGAIN

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
def page_of(router: str, repository: Path) -> Iterator[Callable[..., str]]:
    """`page_of(rig_toml, *words)` starts a viewer, and beside it a service for each of words, which
    are its name and options as one string; the page's address. They must end well.
    """
    started: list[subprocess.Popen[str]] = []

    def start(rig: Path, *beside: str) -> str:
        for words in (*beside, "viewer"):
            service, *options = words.split()
            command = [sys.executable, "-m", f"services.{service}", *options]
            process = subprocess.Popen(
                [*command, "--config", str(rig), "--connect", router],
                stdout=subprocess.PIPE,
                text=True,
                cwd=repository,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
            )
            stack.enter_context(process)
            started.append(process)
        output = started[-1].stdout
        assert output is not None
        line = next(line for line in output if "live view at" in line)
        return line.split("live view at ")[1].split('"')[0].strip()

    with ExitStack() as stack:
        yield start
        for process in started:
            process.terminate()
            process.communicate(timeout=30.0)
    # A viewer ends by itself with a new calibration, to be started again; perhaps just now.
    assert {process.returncode for process in started} <= {0, EXIT_AGAIN}
