"""What must be so on this machine before poses are sent: a fine clock, and the right name."""

from __future__ import annotations

from rhot.bus.security.credentials import client_endpoints, credentials_in
from rhot.bus.security.roles import identity
from rhot.bus.security.tls_diagnosis import read_own_certificate
from rhot.errors import BusError, ConfigError
from rhot.files.config import RigConfig

# A tracker in a hand at 1 m/s is elsewhere by a millimetre.
_COARSE_S = 1e-3


def check_clock(resolution_s: float) -> None:
    """Raises ConfigError if this Python's clock is too coarse for stamps of poses.

    Before Python 3.13 that of Windows steps by 15.6 ms.
    """
    if resolution_s > _COARSE_S:
        raise ConfigError(
            f"this Python's clock steps by {1e3 * resolution_s:.1f} ms, and poses would be stamped"
            " as roughly; on Windows, install Python 3.13 or newer"
        )


def check_instance(config: RigConfig, instance: str) -> None:
    """Raises ConfigError if the router would refuse what this instance sends.

    It lets an object source be called as its certificate is, and drops the rest without a word.
    """
    files = next(filter(None, map(credentials_in, client_endpoints(config))), None)
    if files is None:
        return
    try:
        name = read_own_certificate(files).common_name
    except BusError:
        # Without a certificate there is no session; the bus has said so, or is on loopback.
        return
    who = identity(name)
    if who is None or who.role != "objects" or who.name == instance:
        return
    raise ConfigError(
        f"this machine's certificate is {name}, and the bridge calls itself {instance!r}: start it"
        f" with `--instance {who.name}`"
    )
