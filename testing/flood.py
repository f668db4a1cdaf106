"""A program gone mad: `python -m testing.flood ENDPOINT KIND KEY`, as a process of its own.

huge: messages of 100 MB; garbage: 10^5 messages a second for three seconds; names: 10^5 messages,
each with another name in place of NAME in KEY and payload. Prints how many it sent.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator

import zenoh

from rhot.bus.zenoh_config import client_config

_SECONDS = 3.0
_A_SECOND = 100_000
_NAMES = 100_000
_HUGE = 100_000_000


def _huge(key: str) -> Iterator[tuple[str, bytes]]:
    for _ in range(3):
        yield key, b"x" * _HUGE


def _garbage(key: str) -> Iterator[tuple[str, bytes]]:
    began_s = time.monotonic()
    for count in itertools.count():
        elapsed_s = time.monotonic() - began_s
        if elapsed_s > _SECONDS:
            return
        if count > elapsed_s * _A_SECOND:
            time.sleep(0.002)
        yield key, b"\x00[{garbage" * 8


def _names(key: str, payload: bytes) -> Iterator[tuple[str, bytes]]:
    for number in range(_NAMES):
        name = f"n{number}"
        yield key.replace("NAME", name), payload.replace(b"NAME", name.encode())


def main() -> None:
    """Flood."""
    endpoint, kind, key, *payload = sys.argv[1:]
    messages = {
        "huge": lambda: _huge(key),
        "garbage": lambda: _garbage(key),
        "names": lambda: _names(key, payload[0].encode()),
    }[kind]()
    # Garbage is dropped where the link is full, as live data is; the others wait for the link.
    congestion = zenoh.CongestionControl
    control = congestion.DROP if kind == "garbage" else congestion.BLOCK
    sent = 0
    with zenoh.open(client_config([endpoint])) as session:
        for to, payload_bytes in messages:
            session.put(to, payload_bytes, congestion_control=control)
            sent += 1
    print(sent)


if __name__ == "__main__":
    main()
