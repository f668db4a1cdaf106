"""Zenoh configurations of clients and routers: quick to notice a dead link, quick to be back, no
scouting.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import msgspec
import zenoh

from rhot.bus.security.access_control import access_control
from rhot.bus.security.credentials import plain, with_certificates
from rhot.bus.security.limits import limits
from rhot.errors import BusError
from rhot.files.config import RigConfig

# An attempt to connect is given up after so long; Zenoh's own is 10 s. One that begins just after
# the cable is out, while the neighbour is still in the table, lasts its whole time: poses were back
# 3.4 s after 8 s without a cable. Long enough for a handshake with certificates on a slow computer.
_OPEN_MS = 3000
# Tried again so soon that a link's return waits for the neighbour table and for little else: after
# 8 s without a cable at most 1.13 s where ARP asks once a second, 0.47 s where install.sh has set
# it to four times (deploy/sysctl.d); with pauses of 500 ms 1.22 and 0.71 s.
_RETRY = {"period_init_ms": 100, "period_max_ms": 200, "period_increase_factor": 1.5}
# Live messages that may wait for the thread that sends them, the most that Zenoh allows. Its own 2
# are full where processors are busy for a millisecond, and what is put then is lost: of the markers
# of 32 rigs through one session 1 to 2 % (docs/notes/scale.md). A line that stands keeps so many
# old ones for its return, a quarter of a second of a camera.
_LIVE_WAITING = 16
# Of what Zenoh does not know ("http/...") it says only that nobody answers there.
_ENDPOINT = re.compile(
    r"(?:(?:tcp|tls|udp|quic|ws)/[^\s/?#]+:(?P<port>\d{1,5})|(?:unixsock-stream|serial|vsock)/.+)"
    r"(?:[?#].*)?"
)


def _transport(max_message_bytes: int | None = None) -> dict[str, Any]:
    # A cut cable is noticed after 1.5 s instead of 9 s; QoS keeps pictures from delaying poses.
    link: dict[str, Any] = {
        "tx": {
            "lease": 2000,
            "keep_alive": 4,
            "queue": {"size": {"real_time": _LIVE_WAITING}},
        },
        # A host whose certificate has ended is a stranger at once, not from its next start.
        "tls": {"close_link_on_expiration": True},
    }
    if max_message_bytes is not None:
        link["rx"] = {"max_message_size": max_message_bytes}
    return {
        "link": link,
        "unicast": {"qos": {"enabled": True}, "open_timeout": _OPEN_MS},
        # Who receives through it keeps and locks a sender's pool for ever, also once the sender has
        # ended (eclipse-zenoh/zenoh#2787): a router grew by 7.4 MB whenever a process that sends
        # pictures started again, and lost them without a word once no more could be locked (#2788).
        # Without, a simulated picture of 460 kB takes 0.5 to 1 ms longer and 0.4 to 0.8 ms more
        # processor time; with ten times too much to do 1.1 % were lost (.06 % with it).
        "shared_memory": {"enabled": False},
    }


def client_config(connect: Sequence[str]) -> zenoh.Config:
    """A client of the routers at `connect`, back within half a second of their return.

    Raises BusError for what is no endpoint.
    """
    _check(connect)
    return _config(
        {
            "mode": "client",
            "connect": {
                "endpoints": list(connect),
                "timeout_ms": 0,
                "retry": _RETRY,
            },
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": _transport(),
        }
    )


def router_config(listen: Sequence[str], *rigs: RigConfig) -> zenoh.Config:
    """A router listening at `listen`, inspectable at `@/*/router` from this machine.

    With rigs it lets through what fits those, and joins the routers that their rig.toml name.
    """
    return _config(router_settings(listen, *rigs))


def router_settings(listen: Sequence[str], *rigs: RigConfig) -> dict[str, Any]:
    """What router_config is made of, for Zenoh's own router to read from a file."""
    _check(listen)
    bounds = limits(*rigs) if rigs else {}
    settings: dict[str, Any] = {
        "mode": "router",
        "listen": {"endpoints": list(listen)},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": _transport(bounds.pop("max_message_size", None)),
        "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}},
        **bounds,
    }
    if any(rig.bus.access == "certificates" for rig in rigs):
        settings["access_control"] = access_control(*rigs)
    others = [
        endpoint
        for rig in rigs
        for endpoint in with_certificates(rig.bus.routers, rig.certificates_dir, "connect")
    ]
    if others:
        settings["connect"] = {"endpoints": others, "timeout_ms": -1, "retry": _RETRY}
    return settings


def _check(endpoints: Sequence[str]) -> None:
    for endpoint in endpoints:
        found = _ENDPOINT.fullmatch(endpoint)
        if found is None or int(found["port"] or 0) > 65535:
            raise BusError(
                f"{plain(endpoint)!r} is no address of a router; write it like "
                "tcp/192.168.1.10:7447 (tls/... with certificates)"
            )


def _config(values: dict[str, Any]) -> zenoh.Config:
    try:
        return zenoh.Config.from_json5(msgspec.json.encode(values).decode())
    except zenoh.ZError as error:
        raise BusError(
            f"Zenoh refuses the endpoints {values}: {error}; write them like tcp/192.168.1.10:7447"
        ) from None
