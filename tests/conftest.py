"""Fixtures every room may use: a loopback router, its endpoint, the folder of real recordings."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
import zenoh

from rhot.bus import router_config

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def repository() -> Path:
    """The source tree."""
    return REPOSITORY


@pytest.fixture(scope="session")
def rhot_data() -> Path:
    """Real recordings: $RHOT_DATA, or ../shared/data beside the source tree."""
    folder = Path(os.environ.get("RHOT_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; set RHOT_DATA to their folder")
    return folder


@pytest.fixture
def endpoint() -> str:
    """A loopback endpoint nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def router(endpoint: str) -> Iterator[str]:
    """A real Zenoh router; its endpoint."""
    session = zenoh.open(router_config([endpoint]))
    yield endpoint
    session.close()
