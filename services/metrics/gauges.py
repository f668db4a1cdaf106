"""A family of Prometheus' gauges from rows of labels and values. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from prometheus_client.core import GaugeMetricFamily

from rhot.plain_text import clipped

# Of what a service says of itself; what says more is broken or hostile.
_MAX_LABEL = 100

Row = tuple[Sequence[str], float]


def gauge(name: str, about: str, labels: Sequence[str], rows: Iterable[Row]) -> GaugeMetricFamily:
    """A family of gauges, each row its labels' values and its own."""
    family = GaugeMetricFamily(name, about, labels=labels)
    for values, value in rows:
        family.add_metric([label(one) for one in values], value)
    return family


def label(value: str) -> str:
    """Any text, as a short printable label."""
    return clipped(value, _MAX_LABEL)
