"""Which machine of a rig this one is."""

from __future__ import annotations

import msgspec
import pytest

from rhot.files.config import RigConfig
from services.cli.rig.place import host_and_port, network_hosts, place_of

LAN = {
    "connect": ["tcp/127.0.0.1:7447", "tls/master.local:7448"],
    "listen": ["tcp/127.0.0.1:7447", "tls/0.0.0.0:7448"],
}
PIS = [{"name": "left", "host": "pi-left"}, {"name": "right", "host": "pi-right"}]


def place(own, bus, cameras):
    config = msgspec.convert({"bus": bus, "camera": cameras}, RigConfig)
    return place_of(config, lambda host: host in own)


@pytest.mark.parametrize(
    ("own", "master", "cameras", "certain"),
    [
        ({"master.local"}, True, set(), True),
        ({"pi-left"}, False, {"left"}, True),
        ({"master.local", "pi-right"}, True, {"right"}, True),
        # A master that has moved, or some other computer: where the command runs.
        (set(), True, set(), False),
    ],
)
def test_two_pis_and_a_master(own, master, cameras, certain):
    found = place(own, LAN, PIS)
    assert (found.master, found.cameras, found.certain) == (master, cameras, certain)
    assert found.master_hosts == ("master.local",)


def test_one_machine_is_all_of_its_rig():
    found = place(set(), {}, [{"name": "left"}, {"name": "right"}])
    assert (found.master, found.cameras, found.certain) == (True, {"left", "right"}, True)


def test_a_camera_without_a_host_is_the_masters():
    cameras = [{"name": "desk"}, PIS[0]]
    assert place({"master.local"}, LAN, cameras).cameras == {"desk"}
    assert place({"pi-left"}, LAN, cameras).cameras == {"left"}


@pytest.mark.parametrize(
    ("endpoint", "expected"),
    [
        ("tcp/127.0.0.1:7447", ("127.0.0.1", "7447")),
        ("tls/[fe80::1]:7448", ("fe80::1", "7448")),
        ("tls/master.local:7448#root_ca_certificate_file=/a:b", ("master.local", "7448")),
        ("udp/h:1?rel=0", ("h", "1")),
        ("nonsense", ("", "")),
    ],
)
def test_hosts_and_ports_of_endpoints(endpoint, expected):
    assert host_and_port(endpoint) == expected


def test_hosts_that_others_can_reach():
    local = ("tcp/localhost:1", "tcp/[::1]:1", "tls/[::]:1", "tcp/127.0.0.9:1", "unixsock-stream/x")
    assert network_hosts(local) == ()
    assert network_hosts(("tls/10.0.0.1:1", "tcp/10.0.0.1:2", "tcp/h:1")) == ("10.0.0.1", "h")


@pytest.mark.parametrize(
    ("own", "host", "master", "steamvr"),
    [
        ({"master.local"}, "", True, True),
        ({"master.local"}, "gaming-pc", True, False),
        ({"gaming-pc"}, "gaming-pc", False, True),
        ({"master.local", "gaming-pc"}, "gaming-pc", True, True),
        ({"pi-left"}, "", False, False),
    ],
)
def test_steamvr_runs_where_rig_toml_says(own, host, master, steamvr):
    objects = {"source": "steamvr", "host": host}
    tables = {"bus": LAN, "camera": PIS, "object": [{"name": "cup", "serial": "LHR-1"}]}
    config = msgspec.convert({**tables, "objects": objects}, RigConfig)
    found = place_of(config, lambda name: name in own)
    assert (found.master, found.steamvr, found.certain) == (master, steamvr, True)
