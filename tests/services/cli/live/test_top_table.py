"""The states of `rhot top`, and how it marks what is slow."""

from __future__ import annotations

import msgspec
import pytest

from rhot.health_messages import Health, StreamHealth
from services.cli.live.top_table import ServiceMonitor
from services.cli.live.top_text import table_text

NOW_NS = 1_700_000_000_000_000_000


def stream(**changes):
    values = {
        "key": "rhot/sim/hand/right/pose",
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


@pytest.fixture
def health():
    return Health(
        service="solver",
        instance="main",
        stamp_ns=NOW_NS,
        version="0",
        pid=1,
        uptime_s=5.0,
        state="running",
        streams=[stream()],
        errors=0,
        last_error="",
        cpu_percent=3.0,
        rss_mb=90.0,
    )


@pytest.fixture
def monitor():
    return ServiceMonitor("sim", [("solver", "main")])


def test_a_service_that_never_came_is_absent(monitor):
    table = monitor.table(NOW_NS)
    assert [row.state for row in table.services] == ["absent"]
    assert not table.healthy


def test_running_silent_and_gone(monitor, health):
    monitor.token("solver", "main", True)
    monitor.beat(health, NOW_NS)
    table = monitor.table(NOW_NS + 1_000_000_000)
    assert table.healthy
    assert table.glass_to_pose_ms == {"right": (21.0, 35.0)}
    assert monitor.table(NOW_NS + 4_000_000_000).services[0].state == "silent"
    monitor.token("solver", "main", False)
    assert monitor.table(NOW_NS + 1_000_000_000).services[0].state == "gone"


def test_a_slow_stream_is_marked(monitor, health):
    monitor.token("solver", "main", True)
    monitor.beat(
        msgspec.structs.replace(health, streams=[stream(ok=False, rate_hz=3.0, rejected=5)]), NOW_NS
    )
    table = monitor.table(NOW_NS)
    assert not table.healthy
    line = next(line for line in table_text(table).splitlines() if "hand/right/pose" in line)
    assert line.lstrip().startswith("! out")
    assert "rejected 5" in line


def test_unexpected_services_are_listed_too(monitor, health):
    monitor.token("bridge", "vmc", True)
    assert [(row.service, row.state) for row in monitor.table(NOW_NS).services] == [
        ("solver", "absent"),
        ("bridge", "silent"),
    ]
