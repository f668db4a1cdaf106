"""Health messages as tests need them: a solver with a stream of poses, with whatever is changed."""

from __future__ import annotations

from typing import Any

from rhot.messages.health import Fault, Health, StreamHealth
from rhot.watch.onlooker_faults import fault_of

NOW_NS = 1_700_000_000_000_000_000
SECOND_NS = 1_000_000_000


def stream(key: str = "hand/right/pose", **changes: Any) -> StreamHealth:
    """A stream of the rig `sim` at 30 Hz."""
    values = {
        "key": f"rhot/sim/{key}",
        "direction": "out",
        "count": 30,
        "rate_hz": 30.0,
        "expected_hz": 30.0,
        "ok": True,
        "dropped": 0,
        "rejected": 0,
        "latency_p50_ms": 21.0,
        "latency_p99_ms": 35.0,
    }
    return StreamHealth(**values | changes)


def beat(service: str = "solver", instance: str = "main", **changes: Any) -> Health:
    """A second of a service that is well."""
    values = {
        "service": service,
        "instance": instance,
        "stamp_ns": NOW_NS,
        "version": "0",
        "pid": 1,
        "uptime_s": 5.0,
        "state": "running",
        "streams": [stream()],
        "errors": 0,
        "last_error": "",
        "cpu_percent": 3.0,
        "rss_mb": 90.0,
    }
    return Health(**values | changes)


def fault(
    code: str, text: str = "something is wrong", subject: str = "", since_s: int = 0
) -> Fault:
    """A fault that began so many seconds before NOW_NS."""
    return fault_of(code, text, subject, NOW_NS - since_s * SECOND_NS)
