"""The whole simulated rig as real processes on a router of its own."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import pytest_asyncio

from rhot.bus.bus import Bus, open_bus
from rhot.files.config import load_rig
from services.cli.live.supervisor import Child, Supervisor
from services.cli.live.up import children_of
from services.cli.live.working_copy import working_copy
from testing.loopback import free_endpoint

# numba's first compilation on a loaded machine takes most of it.
START_S = 180.0


@dataclass
class RunningRig:
    """A bus into the running rig, its processes, and what they logged."""

    bus: Bus
    endpoint: str
    config: Path
    supervisor: Supervisor
    logged: list[str] = field(default_factory=list)

    async def until(self, condition: Callable[[], bool], seconds: float = 30.0) -> None:
        """Wait for a condition; on failure, what the services logged is in the message."""
        try:
            async with asyncio.timeout(seconds):
                while not condition():
                    await asyncio.sleep(0.05)
        except TimeoutError:
            pytest.fail("deadline passed; the services logged:\n" + "\n".join(self.logged[-30:]))

    def is_running(self, name: str) -> bool:
        """Whether a process of the rig is there."""
        return Path(f"/proc/{self.supervisor.pids[name]}").exists()


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def rig() -> AsyncIterator[RunningRig]:
    """A copy of the rig of config/sim.toml without its viewer, all services started."""
    endpoint = free_endpoint()
    logged: list[str] = []
    supervisor = Supervisor(lambda name, level, text: logged.append(f"[{name}] {level}: {text}"))
    with working_copy() as config:
        children = children_of(load_rig(config), config, viewer=False, endpoint=[endpoint])
        async with all_running(supervisor, children), open_bus("sim", [endpoint]) as bus:
            running = RunningRig(bus, endpoint, config, supervisor, logged)
            ready = {child.name for child in children} - {"router"}
            await running.until(
                lambda: sum(" ready" in line for line in logged) >= len(ready), START_S
            )
            yield running


@contextlib.asynccontextmanager
async def all_running(supervisor: Supervisor, children: list[Child]) -> AsyncIterator[None]:
    """The children for as long as the block lasts; fails if one is left behind."""
    keepers = [asyncio.create_task(supervisor.keep_running(child)) for child in children]
    try:
        yield
    finally:
        for keeper in keepers:
            keeper.cancel()
        await asyncio.gather(*keepers, return_exceptions=True)
        for pid in supervisor.pids.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, 0)
                pytest.fail(f"process {pid} was left behind")
