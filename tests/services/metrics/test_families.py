"""Prometheus' text of a rig's state: units, counters that add up, and labels that stay bounded."""

from __future__ import annotations

import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.registry import CollectorRegistry

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, RigTable
from services.metrics.counting_monitor import CountingMonitor
from services.metrics.families import families
from services.metrics.service import Snapshot
from testing.sample_health import NOW_NS, SECOND_NS, beat, fault, stream

CONFIG = RigConfig(
    rig=RigTable(name="sim"),
    camera=[CameraTable(name="left"), CameraTable(name="right")],
    hand={"right": HandTable(markers={"index_tip": "blue"})},
)


@pytest.fixture
def monitor():
    return CountingMonitor(CONFIG, NOW_NS)


def scraped(monitor, after_s=2):
    """Every sample as {name: {labels' values in order of their names: value}}, through Prometheus'
    own text and parser.
    """
    snapshot, registry = Snapshot(), CollectorRegistry()
    registry.register(snapshot)
    snapshot.metrics = list(families(monitor.state(NOW_NS + after_s * SECOND_NS), monitor))
    text = generate_latest(registry).decode()
    found = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            found.setdefault(sample.name, {})[
                tuple(v for _, v in sorted(sample.labels.items()))
            ] = sample.value
    return found


def test_a_service_in_prometheus_units(monitor):
    for _ in range(3):
        monitor.beat(beat(streams=[stream(dropped=2)]), NOW_NS + SECOND_NS)
    found = scraped(monitor)
    assert found["rhot_service_up"]["main", "solver"] == 1.0
    assert found["rhot_service_up"]["main", "fusion"] == 0.0
    assert found["rhot_service_resident_memory_bytes"]["main", "solver"] == 90e6
    name = ("out", "main", "rhot/sim/hand/right/pose", "solver")
    assert found["rhot_stream_rate_hertz"][name] == 30.0
    assert found["rhot_stream_latency_seconds"][*name[:3], "0.5", "solver"] == pytest.approx(0.021)
    assert found["rhot_stream_dropped_total"][name] == 6.0
    assert found["rhot_stream_messages_total"][name] == 90.0
    assert found["rhot_glass_to_pose_seconds"]["right", "0.99"] == pytest.approx(0.035)


def test_faults_are_there_while_they_stand(monitor):
    dark = fault("camera_dark", "dark", "left")
    monitor.beat(beat("pi_tracker", "left", faults=[dark]), NOW_NS + SECOND_NS)
    found = scraped(monitor)["rhot_fault"]
    assert found["camera_dark", "error", "left", "pi_tracker/left"] == 1.0
    assert found["service_absent", "error", "fusion", ""] == 1.0
    monitor.beat(beat("pi_tracker", "left"), NOW_NS + SECOND_NS)
    assert not any(labels[0] == "camera_dark" for labels in scraped(monitor)["rhot_fault"])


def test_strangers_cannot_fill_the_memory_or_break_the_text(monitor):
    evil = '\x1b[2J"} 1\nrhot_service_up{service="fake"} 1'
    for number in range(500):
        streams = [stream(f"key/{number}/{k}") for k in range(200)]
        faults = [fault("event", evil, f"{evil}{k}") for k in range(64)]
        monitor.beat(beat("flood", str(number), streams=streams, faults=faults), NOW_NS + SECOND_NS)
    found = scraped(monitor)
    assert len(found["rhot_fault"]) <= 200
    assert len(found["rhot_stream_rate_hertz"]) <= 64 * 64
    assert len(found["rhot_stream_messages_total"]) <= 512
    assert ("fake",) not in found["rhot_service_up"]


def test_a_lost_router_is_told(monitor):
    assert scraped(monitor)["rhot_router_connected"][()] == 1.0
    monitor.connected(False, NOW_NS)
    assert scraped(monitor)["rhot_router_connected"][()] == 0.0
