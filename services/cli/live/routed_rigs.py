"""The rigs whose rules a router keeps to, and where it listens for them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rhot.bus.security.credentials import credentials_in, is_secured, plain, router_endpoints
from rhot.bus.security.tls_diagnosis import own_problem
from rhot.bus.zenoh_config import router_settings
from rhot.errors import BusError, ConfigError, RhotError
from rhot.files.config import RigConfig, load_rig
from rhot.process.rigs.files import rig_files
from services.cli.rig.place import host_and_port, is_local
from services.cli.rig.ports import taken_ports


def routed_rigs(
    paths: Sequence[Path], tell: Callable[[str], None], *, to_run: bool = True
) -> list[RigConfig]:
    """The rigs of files and folders.

    Of several, one whose file cannot be read, that does not fit those before it, or for which this
    host (to_run) cannot listen, is told and left out: the others need their router. Raises
    ConfigError where that leaves none.
    """
    files = rig_files(paths) if paths else []
    if len(files) == 1:
        return [load_rig(files[0])]
    rigs: list[RigConfig] = []
    for file in files:
        try:
            rigs.append(_one_more(file, rigs, to_run=to_run))
        except RhotError as error:
            where = "" if str(file) in str(error) else f"{file}: "
            tell(f"{where}{error}; left out until this router is started again")
    if files and not rigs:
        raise ConfigError(f"none of {', '.join(map(str, files))} is of use (see above)")
    return rigs


def _one_more(file: Path, rigs: Sequence[RigConfig], *, to_run: bool) -> RigConfig:
    """A rig beside those before it; raises RhotError where one router cannot serve it as well."""
    config = load_rig(file)
    _check_fits(config, rigs)
    own = [one for one in router_endpoints(config) if one not in listening_for(rigs)]
    # Raises where a name cannot stand in a certificate, or an address is none.
    router_settings(own, config)
    if to_run:
        check_certificates(own)
        # Other addresses cannot be had where the network is not up yet, by nobody's fault.
        check_ports([one for one in own if is_local(host_and_port(one)[0])])
    return config


def check_certificates(endpoints: Sequence[str]) -> None:
    """Raise BusError where this host's certificates for an endpoint are no good."""
    for endpoint in filter(is_secured, endpoints):
        files = credentials_in(endpoint)
        problem = own_problem(files, time.time()) if files else None
        if problem:
            raise BusError(f"no router can listen at {plain(endpoint)}: {problem}")


def check_ports(endpoints: Sequence[str]) -> None:
    """Raise BusError where another process has a port."""
    taken = taken_ports(endpoints)
    if taken:
        port, owner = next(iter(taken.items()))
        raise BusError(
            f"no router can listen at {', '.join(map(plain, endpoints))}: "
            f"{owner or 'a process of another user'} listens at port {port} already; "
            "if it is a router of yours, use or stop it, else choose another port, e.g. "
            f"--listen tcp/127.0.0.1:{port + 1}"
        )


def listening_for(rigs: Sequence[RigConfig]) -> list[str]:
    """Where the router of these rigs listens, each address once, with its certificates."""
    return list(dict.fromkeys(one for config in rigs for one in router_endpoints(config)))


def _check_fits(config: RigConfig, rigs: Sequence[RigConfig]) -> None:
    """Raise ConfigError where a rig's rules contradict those of others of the same router."""
    taken = {plain(one): (one, other.rig.name) for other in rigs for one in router_endpoints(other)}
    for endpoint in router_endpoints(config):
        first, owner = taken.get(plain(endpoint), (endpoint, ""))
        if first != endpoint:
            raise ConfigError(
                f"rig {owner!r} listens at {plain(endpoint)} with other certificates; "
                "choose another port in [bus] listen, and in [bus] connect"
            )
    for other in rigs:
        if other.rig.name == config.rig.name:
            raise ConfigError(
                f"another rig of this router is called {config.rig.name!r}; "
                "every rig of a network has a [rig] name of its own"
            )
        if other.bus.access != config.bus.access:
            raise ConfigError(
                f'[bus] access is "{config.bus.access}", and "{other.bus.access}" for '
                f"rig {other.rig.name!r}; one router cannot let everybody in and keep to roles"
            )
