"""The guided calibration of the page in a browser: the way to a step, and simulated rigs on which
steps are practised.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import zenoh

from rhot import topics
from rhot.bus.bus import client_config
from services.cli.defaults import sim_toml

# Playwright's milliseconds; a busy machine takes a minute for what else takes seconds.
WAIT = {"timeout": 180e3}
# Services whose kernels were never compiled take minutes, beside other work.
_READY_S = 480.0
DESK, PHONE = (1280, 800), (390, 844)
# Fewer positions of a board than a person is asked for; more make a result more accurate, not
# another thing.
PRACTISED = 8
_RIGHT = '[[camera]]\nname = "right"\nsource = "simulator"\n'


def calibration_tab(
    chromium: Any, url: str, errors: list[str], size: tuple[int, int] = DESK
) -> Any:
    """A visitor's page that shows the guided calibration; errors gets what goes wrong on it. On a
    phone its sheet of controls is opened.
    """
    page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    if size == PHONE:
        page.get_by_text("rhot").first.click(**WAIT)
    page.get_by_role("tab", name="Calibration").click(**WAIT)
    return page


def choose(page: Any, label: str, option: str) -> None:
    """Choose from a list of the panel."""
    page.get_by_label(label, exact=True).first.click(**WAIT)
    page.get_by_role("option", name=option, exact=True).first.click(**WAIT)


def press(page: Any, button: str) -> None:
    """Press a button of the panel once it can be pressed."""
    page.get_by_role("button", name=button, exact=True).click(**WAIT)


def begin(page: Any, positions: int) -> None:
    """Press Start, for so many positions of a board."""
    field = page.get_by_label("positions")
    field.fill(str(positions))
    field.press("Enter")
    press(page, "Start")


def result_of(page: Any, error: str) -> str:
    """What the page says of a result once it tells that error; fails with it if there is none."""
    page.get_by_text(error).or_(page.get_by_text("This did not work.")).first.wait_for(**WAIT)
    said = str(page.locator("body").inner_text())
    assert "This did not work." not in said, said
    return said


def figure(page: Any, name: str) -> str:
    """A figure of the result's table."""
    return str(page.locator("table tr", has_text=name).inner_text().split("\t")[-1].strip())


def simulated_rig(folder: Path, *, cameras: int = 2) -> Path:
    """The rig.toml of a rig to practise on, calibrated: the demo's, or its first camera alone."""
    text = sim_toml().read_text(encoding="utf-8")
    if cameras == 1:
        text = text.replace(_RIGHT, "").partition("[[object]]")[0]
    # A third of the pictures is enough for what is held still or moved slowly.
    text = text.replace('source = "simulator"', 'source = "simulator"\nfps = 10')
    rig = folder / "rig.toml"
    rig.write_text(f"{text}\n[viewer]\nport = 0\n", encoding="utf-8")
    shutil.copytree(sim_toml().parent / "calibration", folder / "calibration")
    return rig


def wait_for_services(router: str, services: Iterable[str]) -> None:
    """Return once these services of a rig of this kind are ready; raises TimeoutError."""
    with zenoh.open(client_config([router])) as session:
        for service in services:
            key = topics.ALIVE.key("sim", service=service, instance="main")
            _wait(lambda key=key: session.liveliness().get(key), f"{service} is not ready")


def wait_for_pictures(router: str, cameras: Iterable[str]) -> None:
    """Return once the trackers of all the cameras have pictures; raises TimeoutError."""
    with zenoh.open(client_config([router])) as session:
        for camera in cameras:
            key = topics.FRAME.key("sim", camera=camera)
            _wait(lambda key=key: session.get(key), f"no picture of {camera} came")


def _wait(ask: Callable[[], Iterable[zenoh.Reply]], otherwise: str) -> None:
    deadline_s = time.monotonic() + _READY_S
    while not any(reply.ok for reply in ask()):
        if time.monotonic() > deadline_s:
            raise TimeoutError(f"{otherwise} after {_READY_S:.0f} s")
        time.sleep(0.2)


def wait_for_change(page: Any, file: Path, before: bytes) -> None:
    """Return once a file is another one, while the page lives on; raises TimeoutError.

    The viewer itself ends with new files, to be started again; nobody starts it here.
    """
    deadline_s = time.monotonic() + WAIT["timeout"] / 1e3
    while not file.exists() or file.read_bytes() == before:
        if time.monotonic() > deadline_s:
            raise TimeoutError(f"{file.name} was not written")
        page.wait_for_timeout(100)
