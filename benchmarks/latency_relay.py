"""One hop of bare Zenoh for benchmarks/latency.py: a callback that puts a payload of its own.

    python benchmarks/latency_relay.py ENDPOINT KEY_IN KEY_OUT PAYLOAD_FILE

The bound that a service stands beside: nothing is decoded, nothing computed. Ends with its stdin.
"""

from __future__ import annotations

import sys
from pathlib import Path

import zenoh

from rhot.bus.zenoh_config import client_config

# Each message begins with its number, which goes along: one may be lost.
NUMBER_BYTES = 8


def main() -> None:
    """Relay until stdin ends."""
    endpoint, key_in, key_out, file = sys.argv[1:]
    payload = Path(file).read_bytes()
    with zenoh.open(client_config([endpoint])) as session:
        publisher = session.declare_publisher(
            key_out,
            priority=zenoh.Priority.REAL_TIME,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
        )
        session.declare_subscriber(
            key_in, lambda sample: publisher.put(sample.payload.to_bytes()[:NUMBER_BYTES] + payload)
        )
        print("ready", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
