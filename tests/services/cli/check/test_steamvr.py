"""What `rhot check` says of SteamVR."""

from __future__ import annotations

import msgspec
import pytest

from rhot.files.config import RigConfig
from services.cli.check import steamvr
from services.cli.check.steamvr import check_steamvr
from services.cli.rig.place import Place

TLS = ["tls/0.0.0.0:7448"]


def found(tmp_path, objects, bus=None, *, here=True) -> list[tuple[str, str]]:
    tables = {"objects": objects, "bus": bus or {}, "object": [{"name": "cup", "serial": "LHR-1"}]}
    config = msgspec.convert(tables, RigConfig)
    place = Place(True, frozenset(), steamvr=here)
    registry = tmp_path / "openvr" / "openvrpaths.vrpath"
    told = check_steamvr(config, tmp_path / "rig.toml", place, registry)
    return [(problem.severity, problem.what) for problem in told]


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A machine with openvr, on which SteamVR was started."""
    (tmp_path / "openvr").mkdir()
    (tmp_path / "openvr" / "openvrpaths.vrpath").write_text("{}")
    monkeypatch.setattr(steamvr, "find_spec", lambda _: object())


def test_nothing_to_say(tmp_path, installed):
    assert found(tmp_path, {"source": "steamvr"}) == []
    assert found(tmp_path, {"source": "libsurvive"}) == []


def test_a_machine_that_cannot_run_the_bridge(tmp_path, installed, monkeypatch):
    monkeypatch.setattr(steamvr, "find_spec", lambda _: None)
    (tmp_path / "openvr" / "openvrpaths.vrpath").unlink()
    package, registry = found(tmp_path, {"source": "steamvr"})
    assert package[0] == registry[0] == "warning"
    assert "pip install 'rhot[openvr]'" in package[1]
    assert "never started SteamVR" in registry[1]
    # Of another machine nothing of it is known.
    assert found(tmp_path, {"source": "steamvr", "host": "gaming-pc"}, here=False) == []


def test_another_machine_needs_a_certificate(tmp_path):
    objects = {"source": "steamvr", "host": "gaming-pc"}
    ((severity, text),) = found(tmp_path, objects, {"listen": TLS}, here=False)
    assert severity == "error"
    assert 'object_sources = ["steamvr"]' in text
    named = {"listen": TLS, "object_sources": ["steamvr"]}
    assert found(tmp_path, objects, named, here=False) == []
    assert found(tmp_path, objects, {"listen": TLS, "access": "open"}, here=False) == []


def test_a_host_that_nobody_reads(tmp_path):
    ((severity, text),) = found(tmp_path, {"source": "libsurvive", "host": "gaming-pc"})
    assert (severity, "only SteamVR's bridge has a host" in text) == ("warning", True)
