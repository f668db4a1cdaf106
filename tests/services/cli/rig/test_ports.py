"""Ports that are taken, and by whom."""

from __future__ import annotations

import os
import socket

import pytest

from services.cli.rig.ports import owner_of, taken_ports


@pytest.mark.parametrize("address", ["127.0.0.1", "::1"])
def test_a_port_with_a_listener_is_taken_and_its_process_named(address):
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with socket.socket(family) as listener:
        try:
            listener.bind((address, 0))
        except OSError:
            pytest.skip(f"this machine has no {address}")
        listener.listen()
        port = listener.getsockname()[1]
        host = f"[{address}]" if ":" in address else address
        assert taken_ports([f"tcp/{host}:{port}"]) == {port: owner_of(port)}
        assert f"(process {os.getpid()})" in owner_of(port)
        # Listening at all addresses meets the one that is taken.
        assert port in taken_ports([f"tls/{'[::]' if ':' in address else '0.0.0.0'}:{port}"])
    assert taken_ports([f"tcp/{host}:{port}"]) == {}
    assert owner_of(port) == ""


def test_endpoints_without_a_port_are_left_out():
    assert taken_ports(["unixsock-stream/run/x", "tcp/127.0.0.1:0", "tcp/h:99999"]) == {}
