"""A rig's state as Prometheus' families of metrics. Pure.

Labels come from the network: their number is bounded, their text printable and short. Units are
seconds, bytes and ratios, as Prometheus' naming asks for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from prometheus_client.core import CounterMetricFamily, Metric

from rhot.faults import FAULTS
from rhot.messages.health import Health
from rhot.watch.rig_state import MISSING, RigState, ServiceRow
from services.metrics.counting_monitor import CountingMonitor, StreamName
from services.metrics.gauges import gauge, label
from services.metrics.object_families import object_families

_SERVICE = ("service", "instance")
_STREAM = ("service", "instance", "direction", "key")
# Of a service and of a fault; what says more is broken or hostile.
_MAX_STREAMS, _MAX_FAULTS = 64, 200
# Their counters go on in this process's lifetime only.
_COUNTERS = (
    ("rhot_stream_messages", "messages published or received"),
    ("rhot_stream_dropped", "messages dropped, as their reader was slower"),
    ("rhot_stream_rejected", "messages that did not decode"),
)


def families(state: RigState, monitor: CountingMonitor) -> Iterator[Metric]:
    """Everything of one scrape."""
    yield gauge("rhot_router_connected", "1 if the router answers", (), [((), _router(state))])
    yield from _services(state.services)
    yield from _streams([row.health for row in state.services if row.health is not None])
    for (name, about), counts in zip(
        _COUNTERS, (monitor.messages, monitor.dropped, monitor.rejected), strict=True
    ):
        yield _counter(name, about, counts)
    yield from _cameras(state)
    yield from object_families(state.objects)
    yield gauge(
        "rhot_glass_to_pose_seconds",
        "age of a pose when it is published, since mid-exposure",
        ("hand", "quantile"),
        [
            ((hand, quantile), ms * 1e-3)
            for hand, both in state.glass_to_pose_ms.items()
            for quantile, ms in zip(("0.5", "0.99"), both, strict=True)
        ],
    )
    yield _faults(state)


def _counter(name: str, about: str, counts: Mapping[StreamName, int]) -> CounterMetricFamily:
    family = CounterMetricFamily(name, about, labels=_STREAM)
    for stream, count in counts.items():
        family.add_metric([label(one) for one in stream], count)
    return family


def _router(state: RigState) -> float:
    return float(state.connection == "ok")


def _services(rows: Sequence[ServiceRow]) -> Iterator[Metric]:
    names = [(row.service, row.instance) for row in rows]
    alive = [float(row.state not in MISSING) for row in rows]
    about = "1 if the service is alive and tells its health"
    yield gauge("rhot_service_up", about, _SERVICE, zip(names, alive, strict=True))
    beats = [row.health for row in rows if row.health is not None]
    figures = (
        ("cpu_ratio", "its process's share of a core", [beat.cpu_percent * 0.01 for beat in beats]),
        ("resident_memory_bytes", "its process's memory", [beat.rss_mb * 1e6 for beat in beats]),
        ("uptime_seconds", "since its start", [beat.uptime_s for beat in beats]),
        ("errors", "errors survived since its start", [float(beat.errors) for beat in beats]),
    )
    own = [(beat.service, beat.instance) for beat in beats]
    for name, about, values in figures:
        yield gauge(f"rhot_service_{name}", about, _SERVICE, zip(own, values, strict=True))


def _streams(beats: Sequence[Health]) -> Iterator[Metric]:
    streams = [
        ((beat.service, beat.instance, stream.direction, stream.key), stream)
        for beat in beats
        for stream in beat.streams[:_MAX_STREAMS]
    ]
    yield gauge(
        "rhot_stream_rate_hertz",
        "messages a second",
        _STREAM,
        [(name, stream.rate_hz) for name, stream in streams],
    )
    yield gauge(
        "rhot_stream_expected_rate_hertz",
        "messages a second that rig.toml leads to expect; 0: none",
        _STREAM,
        [(name, stream.expected_hz) for name, stream in streams],
    )
    yield gauge(
        "rhot_stream_latency_seconds",
        "out: age of what is published; in: time since it was sent",
        (*_STREAM, "quantile"),
        [
            ((*name, quantile), ms * 1e-3)
            for name, stream in streams
            for quantile, ms in (("0.5", stream.latency_p50_ms), ("0.99", stream.latency_p99_ms))
            if ms >= 0.0
        ],
    )


def _cameras(state: RigState) -> Iterator[Metric]:
    yield gauge(
        "rhot_camera_markers",
        "the hands' markers in the newest picture",
        ("camera",),
        [((one.camera,), float(one.markers)) for one in state.cameras if one.markers >= 0],
    )
    yield gauge(
        "rhot_camera_markers_expected",
        "markers that the hands of rig.toml have",
        ("camera",),
        [((one.camera,), float(one.expected_markers)) for one in state.cameras],
    )


def _faults(state: RigState) -> Metric:
    """1 for each that stands; a code that is not ours is `unknown`."""
    labels = ("code", "severity", "teller", "subject")
    rows: dict[tuple[str, ...], float] = {}
    for one in state.faults[:_MAX_FAULTS]:
        code = one.fault.code if one.fault.code in FAULTS else "unknown"
        rows[code, one.fault.severity, one.teller, one.fault.subject] = 1.0
    return gauge("rhot_fault", "1 for each fault that stands", labels, rows.items())
