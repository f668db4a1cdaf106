"""Who is not let in is told why, in one line: by real handshakes with a real router."""

from __future__ import annotations

import asyncio
import contextlib
import logging

import pytest

import rhot
from rhot.bus.bus import open_bus
from rhot.bus.security.credentials import router_endpoints
from rhot.errors import BusError
from services.cli.live.router import running_router
from services.cli.pki.certificates import make_authority
from services.cli.router_session import router_session
from testing.secured_rig import LONG_AGO, NOW, SecuredRig

DEADLINE_S = 60.0


@pytest.fixture
def rig(tmp_path) -> SecuredRig:
    return SecuredRig(tmp_path)


@contextlib.asynccontextmanager
async def router_of(rig):
    async with running_router(router_endpoints(rig.config), rig.config):
        yield


async def refusal(rig, endpoints) -> str:
    """What a command says that connects there."""
    async with router_of(rig):
        with pytest.raises(BusError) as raised:
            async with asyncio.timeout(DEADLINE_S), router_session("desk", endpoints):
                pass
    return str(raised.value)


async def test_a_good_certificate_is_let_in(rig):
    async with router_of(rig), asyncio.timeout(DEADLINE_S):
        async with router_session("desk", rig.as_host("left")):
            pass
        folder = rig.hosts.host("laptop")
        where = f"tls/localhost:{rig.port}"
        async with rhot.connect(where, rig="desk", certificates=folder) as client:
            assert await client.session() is None


async def test_none(rig):
    assert "[bus] certificates" in await refusal(rig, [f"tls/127.0.0.1:{rig.port}"])
    text = await refusal(rig, rig.as_host("nobody"))
    assert "nobody/ca.pem cannot be read" in text
    assert "rhot pki" in text


async def test_ended(rig):
    rig.make("left", "camera", at=LONG_AGO)
    text = await refusal(rig, rig.as_host("left"))
    assert "desk.camera.left" in text
    assert "ended on 20" in text
    assert "rhot pki renew" in text


async def test_of_another_authority(rig):
    other = make_authority("desk", NOW)
    rig.make("left", "camera", authority=other)
    assert "is not of the authority in" in await refusal(rig, rig.as_host("left"))
    # All three files of another authority: it is the router that is not believed.
    everything = rig.hosts.write_host("right", rig.hosts.read_host("left"), other)
    assert everything.is_dir()
    assert "is not to be trusted" in await refusal(rig, rig.as_host("right"))
    # And one that believes in both: the router refuses it.
    ca = everything / "ca.pem"
    ca.write_bytes(ca.read_bytes() + rig.authority.certificate_pem)
    assert "refuses this host's certificate" in await refusal(rig, rig.as_host("right"))


async def test_a_key_that_everybody_may_read_is_a_warning_and_no_routers(rig, caplog):
    (rig.hosts.host("left") / "own.key").chmod(0o644)
    async with router_of(rig), router_session("desk", rig.as_host("left")):
        assert "chmod 600" in caplog.text
    (rig.hosts.host("master") / "own.key").chmod(0o644)
    with pytest.raises(BusError, match="chmod 600"):
        async with router_of(rig):
            pass


async def test_damaged_files(rig):
    (rig.hosts.host("left") / "own.pem").write_text("nonsense")
    assert "damaged" in await refusal(rig, rig.as_host("left"))


async def test_a_router_by_a_name_it_does_not_hold(rig):
    rig.make("master", "master", ["master.example"])
    text = await refusal(rig, rig.as_host("left"))
    assert "does not hold for the name 127.0.0.1" in text
    assert "--host 127.0.0.1" in text


async def test_a_router_whose_certificate_has_ended(rig):
    rig.make("master", "master", ["127.0.0.1"], at=LONG_AGO)
    with pytest.raises(BusError, match=r"no router can listen .* ended on"):
        async with router_of(rig):
            pass


async def test_a_service_says_it_at_once_and_gets_in_once_it_is_mended(rig, caplog):
    rig.make("left", "camera", at=LONG_AGO)
    caplog.set_level(logging.WARNING, logger="rhot.bus")

    async def wait_for_router() -> None:
        async with open_bus("desk", rig.as_host("left")):
            pass

    async with router_of(rig), asyncio.timeout(DEADLINE_S):
        waiting = asyncio.create_task(wait_for_router())
        while not caplog.records:
            await asyncio.sleep(0.05)
        assert "ended on" in caplog.records[0].getMessage()
        assert "certificate_refused" in caplog.records[0].getMessage()
        assert not waiting.done()
        rig.make("left", "camera")
        await waiting
    assert len(caplog.records) == 1


async def test_a_router_that_is_not_there_is_no_certificates_fault(rig, caplog):
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1.0), open_bus("desk", rig.as_host("left")):
            pass
    assert "certificate" not in caplog.text
