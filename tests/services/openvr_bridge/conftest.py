"""A SteamVR behind the real binding, and the rig that reads it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects, ObjectTable

pytest.importorskip("openvr", reason="PyPI openvr is not installed; it is made for x86 alone")

from testing.steamvr import StandIn, device


@pytest.fixture
def steamvr(monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    """SteamVR with one tracker, LHR-1, in slot 3."""
    stand_in = StandIn()
    stand_in.slots[3] = device("LHR-1")
    stand_in.install(monkeypatch)
    yield stand_in
    stand_in.stuck.clear()


@pytest.fixture
def rig(tmp_path: Path) -> RigConfig:
    """A rig with a cup on LHR-1."""
    return RigConfig(
        object=[ObjectTable(name="cup", serial="LHR-1")],
        objects=Objects(source="steamvr", rate_hz=100.0),
        folder=str(tmp_path),
    )
