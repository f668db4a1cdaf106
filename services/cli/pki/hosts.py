"""Which hosts of a rig need a certificate, and by which names they are reached. Pure."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass

from rhot.bus.security.credentials import is_secured, plain
from rhot.bus.security.roles import MASTER, Role, certificate_names
from rhot.errors import BusError
from rhot.files.config import RigConfig


@dataclass(frozen=True)
class Wanted:
    """A certificate to issue: folder and name, role, names and addresses of the host."""

    name: str
    role: Role
    hosts: tuple[str, ...]


def wanted_certificates(
    config: RigConfig, this_host: str, more_hosts: Sequence[str] = ()
) -> list[Wanted]:
    """The master's, one for each computer with cameras, and those of viewers and object sources.

    The master is reached by the names in [bus] connect, by this_host, where the command runs, and
    by more_hosts.
    """
    master = [_host_of(endpoint) for endpoint in config.bus.connect if is_secured(endpoint)]
    wanted = [Wanted(MASTER, "master", master_hosts(this_host, [*master, *more_hosts]))]
    hosts = {camera.name: camera.host for camera in config.camera}
    for role, names in certificate_names(config).items():
        wanted += [Wanted(name, role, with_local([hosts.get(name, "")])) for name in names]
    twice = [one.name for one in wanted if [other.name for other in wanted].count(one.name) > 1]
    if twice:
        raise BusError(
            f"{twice[0]!r} names two hosts in rig.toml (cameras, [bus] viewers, [bus] "
            f"object_sources; {MASTER!r} is the master's); each needs a name of its own"
        )
    return wanted


def master_hosts(this_host: str, more_hosts: Sequence[str]) -> tuple[str, ...]:
    """Names of the master: of this computer, those given, and of loopback, for its own programs."""
    return with_local([*more_hosts, this_host, "localhost", "127.0.0.1", "::1"])


def with_local(hosts: Sequence[str]) -> tuple[str, ...]:
    """The hosts, and each bare name also as NAME.local, as it is called without a name server."""
    found: list[str] = []
    for host in hosts:
        found.append(host)
        if host != "localhost" and "." not in host and not _is_address(host):
            found.append(f"{host}.local")
    return tuple(dict.fromkeys(host for host in found if host and host != ".local"))


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _host_of(endpoint: str) -> str:
    return plain(endpoint).partition("/")[2].rpartition(":")[0].strip("[]")
