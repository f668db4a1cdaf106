"""A rig of real processes whose cameras get rendered pictures, and what the doctor says of it.

Processes can be stopped and started, pictures spoilt; what each service logged is kept.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path

from rhot.bus.bus import Bus, open_bus
from rhot.files.config import load_rig
from services.cli.doctor.diagnose import diagnose
from services.cli.doctor.links import Link, first_cause
from services.cli.doctor.observe import observe
from services.cli.doctor.text import links_text
from services.cli.live.supervisor import Child, Supervisor
from services.cli.live.up import children_of
from services.cli.live.working_copy import working_copy
from testing.loopback import free_endpoint
from testing.picture_feed import PictureFeed

# numba's first compilation on a loaded machine takes most of it; the doctor itself takes 6 s.
_START_S, _NAMED_S = 300.0, 90.0
# Slow enough for two cores that run other tests, too.
_FPS, _PICTURES = 10.0, 60


async def links_of(config: Path, connect: str | None = None) -> list[Link]:
    """What `rhot doctor` finds."""
    return diagnose(await observe(config, connect))


@dataclass
class WatchedRig:
    """Router, two trackers, fusion and solver."""

    config: Path
    endpoint: str
    bus: Bus
    feed: PictureFeed
    children: dict[str, Child]
    supervisor: Supervisor
    logged: list[str]
    keepers: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    # What the doctor said last.
    links: list[Link] = field(default_factory=list)

    def start(self, name: str) -> None:
        """Keep a process running."""
        child = self.children[name]
        self.keepers[name] = asyncio.create_task(self.supervisor.keep_running(child))

    async def stop(self, name: str) -> None:
        """End a process for good."""
        keeper = self.keepers.pop(name)
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)

    async def until(
        self, what: str, true: Callable[[list[Link]], bool], seconds: float = _NAMED_S
    ) -> list[Link]:
        """Ask the doctor until that is true of its links.

        Raises AssertionError with what it and the services said instead.
        """
        try:
            async with asyncio.timeout(seconds):
                while True:
                    self.links = await links_of(self.config, self.endpoint)
                    if true(self.links):
                        return self.links
        except TimeoutError:
            said = links_text(self.links) if self.links else "nothing"
            logged = "\n".join(self.logged[-30:])
            raise AssertionError(
                f"{what} did not come; the doctor says:\n{said}\nthe services logged:\n{logged}"
            ) from None

    async def named(self, *codes: str) -> Link:
        """The first broken link, once it has one of these codes."""

        def has_one(links: list[Link]) -> bool:
            cause = first_cause(links)
            return cause is not None and cause.code in codes

        cause = first_cause(await self.until(" or ".join(codes), has_one))
        assert cause is not None
        return cause

    async def well(self, seconds: float = _NAMED_S) -> None:
        """Wait until every link holds."""
        await self.until("a rig that is well", lambda links: first_cause(links) is None, seconds)

    @contextlib.asynccontextmanager
    async def until_mended(self, mend: Callable[[], object]) -> AsyncIterator[None]:
        """A fault is there for as long as the block lasts; mended, the rig is well again."""
        try:
            yield
        finally:
            mend()
        await self.well(_START_S)


@contextlib.asynccontextmanager
async def watched_rig() -> AsyncIterator[WatchedRig]:
    """The rig of config/sim.toml without its object, once it is well."""
    endpoint = free_endpoint()
    logged: list[str] = []
    supervisor = Supervisor(lambda *line: logged.append(" ".join(line)))
    with working_copy() as config:
        text = config.read_text(encoding="utf-8")
        text = text.replace('source = "simulator"', f'source = "simulator"\nfps = {_FPS}')
        config.write_text(text[: text.index("[[object]]")], encoding="utf-8")
        feed = PictureFeed.rendered(config, _PICTURES)
        wanted = children_of(load_rig(config), config, viewer=False, endpoint=[endpoint])
        children = {child.name: child for child in wanted if child.name != "simulator"}
        router = asyncio.create_task(supervisor.keep_running(children["router"]))
        try:
            async with open_bus("sim", [endpoint]) as bus:
                rig = WatchedRig(config, endpoint, bus, feed, children, supervisor, logged)
                playing = asyncio.create_task(feed.run(bus))
                for name in set(children) - {"router"}:
                    rig.start(name)
                try:
                    await rig.well(_START_S)
                    yield rig
                finally:
                    playing.cancel()
                    for name in list(rig.keepers):
                        await rig.stop(name)
        finally:
            router.cancel()
            await asyncio.gather(router, return_exceptions=True)
