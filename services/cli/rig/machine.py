"""Names and addresses, as this machine sees them: which are its own, which exist, how it is seen.

Resolving may take as long as a name server is away; nobody waits longer than RESOLVE_S.
"""

from __future__ import annotations

import functools
import os
import socket
import sys
import threading
from pathlib import Path

RESOLVE_S = 3.0


@functools.cache
def addresses_of(host: str) -> tuple[str, ...]:
    """All addresses of a host by name or address; none if it is not known in time."""
    found: list[str] = []

    def resolve() -> None:
        try:
            answers = socket.getaddrinfo(host.strip("[]"), None, type=socket.SOCK_STREAM)
        except (OSError, UnicodeError):
            return
        found.extend(str(answer[4][0]) for answer in answers)

    # A thread that may be left behind: getaddrinfo cannot be interrupted.
    thread = threading.Thread(target=resolve, daemon=True)
    thread.start()
    thread.join(RESOLVE_S)
    return tuple(dict.fromkeys(found))


def is_this_machine(host: str) -> bool:
    """Whether a name or address is this machine's."""
    if host.removesuffix(".").removesuffix(".local").lower() == socket.gethostname().lower():
        return True
    return any(_is_own(address) for address in addresses_of(host))


def own_address(towards: str = "") -> str:
    """This machine's address in the network of another host, or of its default route.

    "" if there is no such network.
    """
    for target in (*addresses_of(towards or "localhost"), _SOMEWHERE):
        family = socket.AF_INET6 if ":" in target else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            try:
                # Nothing is sent: connecting a datagram socket only chooses the route.
                probe.connect((target, 9))
            except OSError:
                continue
            address = str(probe.getsockname()[0])
            if not address.startswith("127.") and address != "::1":
                return address
    return ""


def steamvr_registry() -> Path:
    """The file in which SteamVR notes where it is, for this user (openvr's vrpathregistry)."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", ".")) / "openvr" / "openvrpaths.vrpath"
    folder = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(folder) / "openvr" / "openvrpaths.vrpath"


# Reserved for documentation (RFC 5737): whatever leads there is the default route.
_SOMEWHERE = "192.0.2.1"


def _is_own(address: str) -> bool:
    """Whether a socket can be bound there: the kernel knows all addresses of this machine."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True
