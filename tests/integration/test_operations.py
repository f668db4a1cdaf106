"""docs/guide/operations.md: every command line that it shows, run against a rig, over mTLS too."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import pytest_asyncio

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.files.calibration import Exposure
from rhot.files.config import load_rig
from rhot.messages.objects import Contact, Grasp, ObjectContacts
from rhot.process.service import Service
from services.cli.live.supervisor import Child, Supervisor, service_argv
from services.cli.live.working_copy import working_copy
from services.pi_tracker import sources
from services.pi_tracker.service import serve
from services.pi_tracker.sources.controls import Controls
from services.pi_tracker.sources.simulator import SimulatorSource
from testing.loopback import free_ports
from testing.page_commands import Command, commands, run, setup
from tests.integration.conftest import START_S, all_running

pytestmark = [pytest.mark.field, pytest.mark.asyncio(loop_scope="module")]

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "guide" / "operations.md").read_text(encoding="utf-8")
# The section after which the rig is not as it was.
STOPS = "How do I start and stop?"
# Of one command line: a start of Python on a loaded machine takes most of it.
DEADLINE_S = 40.0
FOUND = Exposure(exposure_us=8000.0, gain=2.0, red_gain=1.6, blue_gain=1.7)
# Two simulated cameras at a rate that leaves this machine free, and the bus as a master has it.
RIG = """
[rig]
name = "desk"

[bus]
connect = ["tcp/127.0.0.1:{open}"]
listen = ["tcp/127.0.0.1:{open}", "tls/127.0.0.1:{secured}"]
certificates = "pki"
"""


class SteerableSource(SimulatorSource):
    """The simulated camera, which has an exposure as a Pi's has: it reports what it was told."""

    def __init__(self, bus, camera):
        super().__init__(bus, camera)
        self.controls = Controls()

    async def frames(self):
        async for frame in super().frames():
            request = self.controls.take()
            if request is not None:
                self.controls.reported = request.exposure
            elif self.controls.watched:
                # Another object each time, as a camera's metadata are.
                self.controls.reported = Exposure(
                    exposure_us=FOUND.exposure_us,
                    gain=FOUND.gain,
                    red_gain=FOUND.red_gain,
                    blue_gain=FOUND.blue_gain,
                )
            yield frame


@dataclass
class Desk:
    """The rig of the page: where its files are, and its ports."""

    config: Path
    open_port: int
    secured_port: int

    def here(self, text: str) -> str:
        """A command line of the page for this rig."""
        names = {
            "/etc/rhot/rig.toml": str(self.config),
            "/etc/rhot/": f"{self.config.parent}/",
            "127.0.0.1:7447": f"127.0.0.1:{self.open_port}",
            "master.local:7448": f"127.0.0.1:{self.secured_port}",
        }
        for name, real in names.items():
            text = text.replace(name, real)
        return text

    def seen_here(self, command: Command) -> Command:
        """A command of the page, and what it should print, for this rig."""
        expected = tuple(map(self.here, command.expected))
        return Command(command.section, self.here(command.line), expected)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def desk() -> AsyncIterator[Desk]:
    """A simulated rig called desk on a router that listens in the open and secured."""
    with tempfile.TemporaryDirectory() as folder, working_copy(Path(folder) / "rig") as config:
        ports = free_ports(2)
        text = config.read_text().replace('[rig]\nname = "sim"\n', "")
        text = text.replace('source = "simulator"', 'source = "simulator"\nfps = 10.0')
        config.write_text(RIG.format(open=ports[0], secured=ports[1]) + text)
        rig = load_rig(config)
        pki = [sys.executable, "-m", "services.cli", "pki", "init"]
        options = ["--config", str(config), "--host", "127.0.0.1"]
        await asyncio.to_thread(subprocess.run, [*pki, *options], check=True, capture_output=True)
        shutil.copytree(config.parent / "pki-hosts" / "master", config.parent / "pki")
        common = ["--config", str(config)]
        children = [
            Child("router", service_argv("cli", "router", *common)),
            Child("pi_tracker", service_argv("pi_tracker", *common, "--camera", "right")),
            *(
                Child(name, service_argv(name, *common))
                for name in ("simulator", "fusion", "solver", "object_tracker")
            ),
        ]
        logged: list[str] = []
        supervisor = Supervisor(lambda name, _, line: logged.append(f"[{name}] {line}"))
        async with all_running(supervisor, children), steerable_tracker(rig), held_cup(rig):
            async with asyncio.timeout(START_S):
                while sum(" ready" in line for line in logged) < len(children) - 1:
                    await asyncio.sleep(0.1)
                # Its first pose has run every compiled function once.
                async with open_bus("desk", list(rig.bus.connect)) as bus:
                    await anext(bus.latest(topics.POSE))
            yield Desk(config, *ports)


@contextlib.asynccontextmanager
async def steerable_tracker(rig):
    """The left camera's tracker in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "open_source", lambda *given: SteerableSource(given[2], "left"))
        async with open_bus("desk", list(rig.bus.connect)) as bus, asyncio.TaskGroup() as tasks:
            service = Service("pi_tracker", "left", rig, bus, tasks)
            running = [tasks.create_task(one) for one in (serve(service), service.beat())]
            yield
            for task in running:
                task.cancel()


@contextlib.asynccontextmanager
async def held_cup(rig):
    """Somebody who says all the time that the right hand holds the cup: the simulated one plays."""
    async with open_bus("desk", list(rig.bus.connect)) as bus, asyncio.TaskGroup() as tasks:
        publisher = bus.publisher(topics.CONTACTS, object="cup")

        async def publish():
            for seq in itertools.count():
                publisher.put(holding_cup(seq, clock.now_ns()))
                await asyncio.sleep(0.1)

        running = tasks.create_task(publish())
        yield
        running.cancel()


def holding_cup(seq: int, now_ns: int) -> ObjectContacts:
    """Thumb and index hold it, and have touched it for a second."""
    since_ns = now_ns - 1_000_000_000
    contacts = [
        Contact(
            hand="right",
            part=part,
            distance_m=-0.0003,
            sigma_m=0.0011,
            point_m=(0.0, 0.0, 0.5),
            touching=True,
            since_ns=since_ns,
        )
        for part in ("thumb", "index")
    ]
    grasp = Grasp(hand="right", parts=["thumb", "index"], since_ns=since_ns)
    return ObjectContacts(object="cup", seq=seq, stamp_ns=now_ns, contacts=contacts, grasps=[grasp])


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def results(desk, tmp_path_factory) -> dict[Command, tuple[int, str]]:
    """Exit code and output of every command: sections side by side, for most of the time is
    Python's start; what stops the rig comes last.
    """
    folder = tmp_path_factory.mktemp("operator")
    # Console scripts of this environment first, as in a shell where it is activated.
    before = f"set -o pipefail\nPATH={Path(sys.executable).parent}:$PATH\n{desk.here(setup(PAGE))}"
    sections: dict[str, list[Command]] = {}
    for command in commands(PAGE):
        sections.setdefault(command.section, []).append(command)
    last = sections.pop(STOPS)
    found: dict[Command, tuple[int, str]] = {}
    places = asyncio.Semaphore(3)

    async def section(group: list[Command]) -> None:
        async with places:
            for one in group:
                here = desk.seen_here(one)
                found[one] = await run(here.line, before, folder, here, DEADLINE_S)

    await asyncio.gather(*(section(group) for group in sections.values()))
    await section(last)
    return found


async def test_the_page_answers_every_question():
    found = commands(PAGE)
    assert len(found) > 25
    silent = [one.line for one in found if not one.expected]
    assert all("> left.png" in line or " put " in line for line in silent), silent


@pytest.mark.parametrize("command", commands(PAGE), ids=lambda one: one.line[:60])
async def test_every_command_of_the_page_does_what_it_says(desk, results, command: Command):
    code, output = results[command]
    missing = desk.seen_here(command).missing(output)
    assert not missing, f"{missing} is not in what `{command.line}` printed:\n{output[-4000:]}"
    assert code in ((0, 1) if "rhot doctor" in command.line else (0,)), output[-4000:]
    assert "Traceback" not in output
