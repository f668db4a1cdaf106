"""The rigs whose rules a router keeps to, and where it listens for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rhot.bus.security.credentials import plain, router_endpoints
from rhot.errors import ConfigError, RhotError
from rhot.files.config import RigConfig, load_rig
from rhot.process.rigs.files import rig_files


def routed_rigs(paths: Sequence[Path], tell: Callable[[str], None]) -> list[RigConfig]:
    """The rigs of files and folders.

    Of several, one whose file cannot be read, or that does not fit those before it, is told and
    left out: the others need their router. Raises ConfigError where that leaves none.
    """
    files = rig_files(paths) if paths else []
    rigs: list[RigConfig] = []
    for file in files:
        try:
            config = load_rig(file)
            _check_fits(file, config, rigs)
        except RhotError as error:
            if len(files) == 1:
                raise
            tell(f"{error}; left out until this router is started again")
        else:
            rigs.append(config)
    if files and not rigs:
        raise ConfigError(f"none of {', '.join(map(str, files))} is of use (see above)")
    return rigs


def listening_for(rigs: Sequence[RigConfig]) -> list[str]:
    """Where the router of these rigs listens, each address once, with its certificates."""
    return list(dict.fromkeys(one for config in rigs for one in router_endpoints(config)))


def _check_fits(file: Path, config: RigConfig, rigs: Sequence[RigConfig]) -> None:
    """Raise ConfigError where a rig's rules contradict those of others of the same router."""
    taken = {plain(one): (one, other.rig.name) for other in rigs for one in router_endpoints(other)}
    for endpoint in router_endpoints(config):
        first, owner = taken.get(plain(endpoint), (endpoint, ""))
        if first != endpoint:
            raise ConfigError(
                f"{file}: rig {owner!r} listens at {plain(endpoint)} with other certificates; "
                "choose another port in [bus] listen, and in [bus] connect"
            )
    for other in rigs:
        if other.rig.name == config.rig.name:
            raise ConfigError(
                f"{file}: another rig of this router is called {config.rig.name!r}; "
                "every rig of a network has a [rig] name of its own"
            )
        if other.bus.access != config.bus.access:
            raise ConfigError(
                f'{file}: [bus] access is "{config.bus.access}", and "{other.bus.access}" for '
                f"rig {other.rig.name!r}; one router cannot let everybody in and keep to roles"
            )
