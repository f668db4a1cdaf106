"""Objects as Prometheus' families: state, age, who touches and who holds. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from prometheus_client.core import Metric

from rhot.watch.object_words import WORDS
from rhot.watch.rig_state import ObjectRow
from services.metrics.gauges import gauge

_OBJECT = ("object",)
_STATES = ("absent", "silent", *WORDS)


def object_families(rows: Sequence[ObjectRow]) -> Iterator[Metric]:
    """Nothing but names where there is no object."""
    yield gauge(
        "rhot_object_state",
        "1 for the state that an object is in, 0 for the others",
        ("object", "state"),
        [((row.object, state), float(row.state == state)) for row in rows for state in _STATES],
    )
    heard = [row for row in rows if row.heard_ns and row.state != "silent"]
    yield gauge(
        "rhot_object_registered",
        "1 if its poses are in the rig's frame",
        _OBJECT,
        [((row.object,), float(row.registered)) for row in heard],
    )
    yield gauge(
        "rhot_object_age_seconds",
        "from the stamp of its newest pose to its arrival",
        _OBJECT,
        [((row.object,), row.age_ms * 1e-3) for row in heard],
    )
    yield gauge(
        "rhot_object_sigma_meters",
        "standard deviation of its place, as it is told",
        _OBJECT,
        [((row.object,), row.sigma_m) for row in heard if row.sigma_m is not None],
    )
    yield gauge(
        "rhot_object_contacts",
        "finger tips and palms that touch it",
        _OBJECT,
        [((row.object,), float(sum(map(len, row.touching.values())))) for row in rows],
    )
    yield gauge(
        "rhot_object_held",
        "fingers, and palm, with which a hand holds it",
        ("object", "hand"),
        [
            ((row.object, hand), float(len(parts)))
            for row in rows
            for hand, parts in row.held_by.items()
        ],
    )
