"""Own names and addresses."""

from __future__ import annotations

import socket

import pytest

from services.cli.rig.machine import addresses_of, is_this_machine, own_address


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "127.0.0.9", socket.gethostname()])
def test_this_machine(host):
    assert is_this_machine(host)


def test_the_networks_name_of_this_machine():
    assert is_this_machine(f"{socket.gethostname()}.local")


# RFC 5737 and RFC 2606: addresses and names that nobody has.
@pytest.mark.parametrize("host", ["203.0.113.7", "no-such-host.invalid", "", "a" * 300])
def test_not_this_machine(host):
    assert not is_this_machine(host)


def test_nobody_knows_an_invalid_name():
    assert addresses_of("no-such-host.invalid") == ()
    assert addresses_of("127.0.0.1") == ("127.0.0.1",)


def test_the_own_address_is_none_of_the_loopback():
    assert not own_address().startswith("127.")
    assert own_address("127.0.0.1") == own_address()
