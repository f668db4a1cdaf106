"""Two Pis and a master as real systemd hosts, made once for all tests of this folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from testing.hosts import missing
from testing.hosts.fault_table import FaultTable
from testing.hosts.hosted_rig import HostedRig, hosted_rig
from testing.hosts.poses import PoseWatch

_TABLE = pytest.StashKey[FaultTable]()
_WRITTEN = Path(os.environ.get("RHOT_SYSTEM_JSON", "build/system.json"))
# From the start of the units to the first poses, on a machine that does much else.
FIRST_POSES_S = 120.0


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_TABLE] = FaultTable()


@pytest.fixture(scope="session")
def table(pytestconfig: pytest.Config) -> FaultTable:
    """What the faults cost; printed at the end, and written to build/system.json."""
    return pytestconfig.stash[_TABLE]


def pytest_terminal_summary(terminalreporter, config: pytest.Config) -> None:
    table = config.stash[_TABLE]
    if table.rows:
        terminalreporter.section("faults of the installed rig")
        terminalreporter.write_line(table.as_text())
        table.write(_WRITTEN)
        terminalreporter.write_line(f"written to {_WRITTEN}")


@pytest.fixture(scope="session")
def rig() -> Iterator[HostedRig]:
    """The hosts, installed; every service was started by systemd."""
    if reason := missing():
        pytest.skip(reason)
    with hosted_rig() as hosts:
        yield hosts


@pytest.fixture(scope="session")
def watch(rig: HostedRig) -> Iterator[PoseWatch]:
    """Sees the poses; they come already."""
    seen = rig.new_watch()
    try:
        if seen.wait_first(FIRST_POSES_S) is None:
            pytest.fail(f"no poses within {FIRST_POSES_S} s\n{rig.journals()}")
        yield seen
    finally:
        seen.close()
