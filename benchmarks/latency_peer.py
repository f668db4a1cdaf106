"""Any process of benchmarks/latency.py as a peer: directly to the others, without a router.

    python benchmarks/latency_peer.py hub ENDPOINT
    python benchmarks/latency_peer.py MODULE [ARGUMENTS]

Each listens at a port of its own and hears of the others from the hub, which is a peer that does
nothing else. A configuration of the benchmark alone: docs/notes/latency.md says why rhot has none.
"""

from __future__ import annotations

import runpy
import sys
from collections.abc import Sequence

import zenoh

from rhot.bus import zenoh_config

client_config = zenoh_config.client_config


def peer_config(connect: Sequence[str], listen: str = "tcp/127.0.0.1:0") -> zenoh.Config:
    """As client_config, but of a peer of those that the hub at `connect` knows."""
    config = client_config(connect)
    config.insert_json5("mode", '"peer"')
    config.insert_json5("listen/endpoints", f'["{listen}"]')
    config.insert_json5("scouting/gossip/enabled", "true")
    return config


def main() -> None:
    """Be the hub until stdin ends, or run a module as a peer."""
    what, *arguments = sys.argv[1:]
    if what == "hub":
        with zenoh.open(peer_config([], arguments[0])):
            sys.stdin.read()
        return
    # Before anything imports it by name.
    zenoh_config.client_config = peer_config
    sys.argv = [what, *arguments]
    runpy.run_module(what, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
