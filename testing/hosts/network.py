"""Hosts as network namespaces: each has one cable (a veth pair) to a switch (a bridge).

The switch lies in a namespace of its own, so nothing shows in this machine's network. A cable can
be pulled at the switch's end: the host sees its carrier go, as with a real one.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from testing.hosts.commands import run

_FOLDER = Path("/run/netns")
_SUBNET = "10.77.0"
# Namespaces of a test run are called rhot-<process>-<name>.
_PREFIX = "rhot-"


class Network:
    """A LAN; made by `lan()`."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._prefix = f"{_PREFIX}{os.getpid()}-"
        self._switch = f"{self._prefix}switch"
        self.addresses = {name: f"{_SUBNET}.{number}" for number, name in enumerate(names, 1)}

    def namespace(self, host: str) -> str:
        """Name of a host's network namespace, as `ip netns` knows it."""
        return self._prefix + host

    def namespace_path(self, host: str) -> Path:
        """The file that stands for a host's network namespace."""
        return _FOLDER / self.namespace(host)

    def build(self) -> None:
        """The switch, and a cable to every host."""
        run(["ip", "netns", "add", self._switch])
        self._at_switch("link", "add", "lan", "type", "bridge")
        self._at_switch("link", "set", "lan", "up")
        for host, address in self.addresses.items():
            namespace = self.namespace(host)
            run(["ip", "netns", "add", namespace])
            self._at_switch(
                *("link", "add", f"to-{host}", "type", "veth"),
                *("peer", "name", "eth0", "netns", namespace),
            )
            self._at_switch("link", "set", f"to-{host}", "master", "lan", "up")
            run(["ip", "-n", namespace, "link", "set", "lo", "up"])
            run(["ip", "-n", namespace, "addr", "add", f"{address}/24", "dev", "eth0"])
            run(["ip", "-n", namespace, "link", "set", "eth0", "up"])

    def unplug(self, host: str) -> None:
        """Pull a host's cable."""
        self._at_switch("link", "set", f"to-{host}", "down")

    def plug(self, host: str) -> None:
        """Plug a host's cable in again."""
        self._at_switch("link", "set", f"to-{host}", "up")

    def remove(self) -> None:
        """Nothing of it is left, whatever state it was in."""
        for path in list(_FOLDER.glob(f"{self._prefix}*")):
            run(["ip", "netns", "del", path.name], check=False)

    def _at_switch(self, *words: str) -> None:
        run(["ip", "-n", self._switch, *words])


@contextlib.contextmanager
def lan(*names: str) -> Iterator[Network]:
    """A LAN of these hosts for as long as the block lasts."""
    _remove_of_dead_runs()
    network = Network(names)
    try:
        network.build()
        yield network
    finally:
        network.remove()


def _remove_of_dead_runs() -> None:
    """Namespaces of a test run that was killed before it could tidy up."""
    for path in list(_FOLDER.glob(f"{_PREFIX}*-*")):
        owner = path.name.removeprefix(_PREFIX).partition("-")[0]
        if owner.isdigit() and not Path(f"/proc/{owner}").exists():
            run(["ip", "netns", "del", path.name], check=False)
