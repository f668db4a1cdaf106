"""A bus for a command that a person waits for: BusError after three seconds without a router.

Services wait for the router instead, as long as it takes (rhot.bus.bus.open_bus).
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from pathlib import Path

from rhot.bus.bus import Bus
from rhot.bus.bus_within import open_bus_within
from rhot.bus.security.credentials import client_endpoints, with_certificates
from rhot.files.config import RigConfig, load_rig
from services.cli.defaults import sim_toml

# A router on the same network answers within milliseconds.
_TIMEOUT_S = 3.0


def rig_and_endpoints(config: Path | None, connect: str | None) -> tuple[RigConfig, list[str]]:
    """The rig of a rig.toml (default: the simulated one) and where its router is."""
    rig = load_rig(config or sim_toml())
    return rig, endpoints_of(rig, connect)


def endpoints_of(rig: RigConfig, connect: str | None) -> list[str]:
    """Where a rig's router is, or the given endpoint, with this host's certificates."""
    if connect:
        return with_certificates([connect], rig.certificates_dir, "connect")
    return client_endpoints(rig)


@contextlib.asynccontextmanager
async def router_session(rig: str, endpoints: list[str]) -> AsyncIterator[Bus]:
    """A bus of the rig named `rig`, connected to the router at one of the endpoints.

    Raises BusError if none answers in time, or a certificate is not accepted.
    """
    advice = "start the rig (`rhot demo`, `rhot up CONFIG`) or name another with --connect"
    async with open_bus_within(_TIMEOUT_S, rig, endpoints, advice) as bus:
        yield bus
