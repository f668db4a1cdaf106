"""Two rigs at one router, each with an authority and a port: neither enters the other."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from pathlib import Path

import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import ConfigError
from services.cli.live.routed_rigs import listening_for, routed_rigs
from services.cli.live.router import running_router
from testing.secured_rig import SecuredRig

DEADLINE_S = 60.0
QUIET_S = 1.0


@pytest.fixture
async def rigs(tmp_path):
    desk, lab = SecuredRig(tmp_path / "desk", "desk"), SecuredRig(tmp_path / "lab", "lab")
    both = routed_rigs([desk.path, lab.path], pytest.fail)
    async with running_router(listening_for(both), *both):
        yield desk, lab


async def arrives(sender: Bus, receiver: Bus, seconds: float, **names: str) -> bool:
    """Whether a camera's markers arrive within that time, however often they are sent."""
    subscription = receiver.raw(topics.MARKERS, 8, **names)
    publisher = sender.publisher(topics.MARKERS, **names)
    try:
        async with asyncio.timeout(seconds):
            arrived = asyncio.ensure_future(anext(subscription))
            while not arrived.done():
                publisher.put_bytes(b"{}")
                await asyncio.wait([arrived], timeout=0.05)
        return True
    except TimeoutError:
        arrived.cancel()
        return False
    finally:
        receiver.close(subscription)
        publisher.undeclare()


async def test_each_rigs_cameras_send_by_their_own_port_and_for_their_own_rig(rigs):
    desk, lab = rigs
    async with contextlib.AsyncExitStack() as stack:

        async def bus(name: str, endpoints: list[str]) -> Bus:
            return await stack.enter_async_context(open_bus(name, endpoints))

        async with asyncio.timeout(DEADLINE_S):
            # By the first rig's open address, as the services of both rigs on the master.
            masters = {one: await bus(one, desk.open) for one in ("desk", "lab")}
            cameras = {
                "desk": await bus("desk", desk.as_host("left")),
                "lab": await bus("lab", lab.as_host("left")),
            }
            intruder = await bus("desk", lab.as_host("left"))
        for name, camera in cameras.items():
            assert await arrives(camera, masters[name], DEADLINE_S, camera="left")
        assert not await arrives(intruder, masters["desk"], QUIET_S, camera="left")


async def test_another_rigs_authority_lets_nobody_in_by_this_ones_port(rigs):
    desk, lab = rigs
    strangers = [one.replace(f":{desk.port}", f":{lab.port}") for one in desk.as_host("left")]
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(2.0), open_bus("desk", strangers):
            pass


def rig_file(folder: Path, name: str, *lines: str) -> Path:
    folder.mkdir()
    path = folder / "rig.toml"
    path.write_text("\n".join([f'[rig]\nname = "{name}"\n[bus]', *lines]))
    return path


@pytest.mark.parametrize(
    ("name", "lines", "why"),
    [
        ("desk", (), "is called 'desk'"),
        ("lab", ('access = "open"',), 'access is "open"'),
        ("lab", ('listen = ["tls/0.0.0.0:7448"]',), "choose another port"),
        ("lab", ('connect = ["tls/0.0.0.0:7449"]', "listen = ['tcp/7449']"), "tcp/7449"),
        ("of.camera.names", (), "cannot stand in a certificate"),
        ("lab", ("listens = 3",), "listens"),
        ("lab", ("no toml",), "rig.toml"),
    ],
)
def test_a_rig_that_does_not_fit_is_left_out_and_told(tmp_path, name, lines, why):
    first = rig_file(tmp_path / "one", "desk", 'listen = ["tls/0.0.0.0:7448"]')
    other = rig_file(tmp_path / "two", name, *lines)
    told: list[str] = []
    rigs = routed_rigs([first, other], told.append, to_run=False)
    assert [config.rig.name for config in rigs] == ["desk"]
    (text,) = told
    assert text.count(str(other)) == 1
    assert why in text
    assert "left out until this router is started again" in text


def test_a_rig_that_this_host_cannot_listen_for_is_left_out(tmp_path):
    first = rig_file(tmp_path / "one", "desk")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        busy = rig_file(tmp_path / "two", "lab", f'listen = ["tcp/127.0.0.1:{port}"]')
        bare = rig_file(tmp_path / "three", "attic", 'listen = ["tls/0.0.0.0:7449"]')
        told: list[str] = []
        assert [one.rig.name for one in routed_rigs([first, busy, bare], told.append)] == ["desk"]
    assert f"port {port} already" in told[0]
    assert "ca.pem" in told[1]
    # Elsewhere, a zenohd may have both.
    assert len(routed_rigs([first, busy, bare], pytest.fail, to_run=False)) == 3


def test_a_router_without_any_rig_it_was_given_does_not_run(tmp_path):
    wrong = [rig_file(tmp_path / name, "desk", "no toml") for name in ("one", "two")]
    told: list[str] = []
    with pytest.raises(ConfigError, match="is of use"):
        routed_rigs(wrong, told.append)
    assert len(told) == 2
    with pytest.raises(ConfigError):
        routed_rigs(wrong[:1], pytest.fail)
