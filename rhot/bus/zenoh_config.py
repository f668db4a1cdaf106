"""Zenoh configurations of clients and routers: quick to notice a dead link, quick to be back, no
scouting.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import zenoh

from rhot.errors import BusError

# Of shared memory for what goes to processes of the same machine: room for eight pictures of 640 x
# 480. Zenoh's own 16 MB, one pool in the sender and its image in each receiver, brought a tracker
# that gets simulated pictures to 137 MB.
_POOL_BYTES = 4 << 20


def _transport() -> dict[str, Any]:
    # A cut cable is noticed after 1.5 s instead of 9 s; QoS keeps pictures from delaying poses.
    return {
        "link": {"tx": {"lease": 2000, "keep_alive": 4}},
        "unicast": {"qos": {"enabled": True}},
        "shared_memory": {"transport_optimization": {"pool_size": _POOL_BYTES}},
    }


def client_config(connect: Sequence[str]) -> zenoh.Config:
    """A client of the routers at `connect`, back within half a second of their return."""
    return _config(
        {
            "mode": "client",
            "connect": {
                "endpoints": list(connect),
                "timeout_ms": 0,
                "retry": {
                    "period_init_ms": 100,
                    "period_max_ms": 500,
                    "period_increase_factor": 1.5,
                },
            },
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": _transport(),
        }
    )


def router_config(listen: Sequence[str]) -> zenoh.Config:
    """A router listening at `listen`, inspectable at `@/*/router`."""
    return _config(
        {
            "mode": "router",
            "listen": {"endpoints": list(listen)},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": _transport(),
            "adminspace": {"enabled": True, "permissions": {"read": True, "write": False}},
        }
    )


def _config(values: dict[str, Any]) -> zenoh.Config:
    try:
        return zenoh.Config.from_json5(msgspec.json.encode(values).decode())
    except zenoh.ZError as error:
        raise BusError(
            f"Zenoh refuses the endpoints {values}: {error}; write them like tcp/192.168.1.10:7447"
        ) from None
