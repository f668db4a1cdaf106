"""Which machine of a rig this one is: the master, the Pi of a camera, or both. Pure.

rig.toml is the same on all machines, but colours and exposure live beside the camera, lenses and
rig.json on the master: what is missing here depends on where here is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from ipaddress import ip_address

from rhot.bus.security.credentials import plain
from rhot.files.config import RigConfig


@dataclass(frozen=True)
class Place:
    """What runs here: fusion, solver and the like if master; the trackers of these cameras; the
    bridge to SteamVR.
    """

    master: bool
    cameras: frozenset[str]
    # Names or addresses of the master in rig.toml, as other machines see it.
    master_hosts: tuple[str, ...] = ()
    # False if nothing in rig.toml names this machine: it is taken for the master, where the user
    # runs the command.
    certain: bool = True
    steamvr: bool = False


def place_of(config: RigConfig, is_here: Callable[[str], bool]) -> Place:
    """The place of the machine for whose names and addresses is_here() is true."""
    hosts = network_hosts((*config.bus.connect, *config.bus.listen))
    on_pi = frozenset(c.name for c in config.camera if c.host and is_here(c.host))
    named = any(is_here(host) for host in hosts)
    bridge = config.objects.source == "steamvr" and bool(config.object)
    apart = bridge and bool(config.objects.host) and is_here(config.objects.host)
    master = named or not (on_pi or apart)
    beside = frozenset(c.name for c in config.camera if not c.host) if master else frozenset()
    return Place(
        master,
        on_pi | beside,
        hosts,
        certain=named or bool(on_pi) or apart or not hosts,
        steamvr=apart or (bridge and master and not config.objects.host),
    )


def network_hosts(endpoints: Iterable[str]) -> tuple[str, ...]:
    """Hosts of endpoints that other machines can reach, without those that stand for all."""
    hosts = [host_and_port(endpoint)[0] for endpoint in endpoints]
    return tuple(dict.fromkeys(host for host in hosts if host and not is_local(host)))


def host_and_port(endpoint: str) -> tuple[str, str]:
    """Of PROTOCOL/HOST:PORT?METADATA#CONFIGURATION, as Zenoh writes endpoints; no brackets."""
    address = plain(endpoint).partition("?")[0].partition("/")[2]
    host, _, port = address.rpartition(":")
    return host.strip("[]"), port


def is_local(host: str) -> bool:
    """Whether a host is the loopback, or the address that stands for all of a machine."""
    if host == "localhost":
        return True
    try:
        address = ip_address(host)
    except ValueError:
        return False
    return address.is_loopback or address.is_unspecified
