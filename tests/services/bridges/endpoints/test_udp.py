"""Datagrams to a real socket, which comes and goes."""

from __future__ import annotations

import asyncio
import socket

import pytest

from rhot.errors import BusError
from services.bridges.endpoints.udp import open_udp


def listener(port: int = 0) -> socket.socket:
    ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ear.bind(("127.0.0.1", port))
    ear.settimeout(5.0)
    return ear


async def test_a_listener_that_goes_is_noticed_and_found_again():
    with listener() as ear:
        port = ear.getsockname()[1]
        link = await open_udp("127.0.0.1", port, "bridges.vmc")
        link.send(b"one")
        assert ear.recv(16) == b"one"
        assert link.status == f"sending to 127.0.0.1:{port}"
    while not link.refused:
        link.send(b"into the void")
        await asyncio.sleep(0.01)
    assert link.status == f"nobody listens at 127.0.0.1:{port}"
    assert link.dropped >= 1
    with listener(port) as ear:
        while link.refused:
            link.send(b"two")
            await asyncio.sleep(0.01)
        assert ear.recv(16) == b"two"
    link.close()


async def test_a_listener_that_does_not_read_costs_nothing():
    with listener() as ear:
        link = await open_udp("127.0.0.1", ear.getsockname()[1], "bridges.vmc")
        for _ in range(5000):
            link.send(bytes(1400))
        assert link.sent + link.dropped == 5000
        link.close()


async def test_a_host_that_is_not_there_is_told_with_its_table():
    with pytest.raises(BusError, match=r"no-such-host.invalid:9.*\[bridges.vmc\]"):
        await open_udp("no-such-host.invalid", 9, "bridges.vmc")
