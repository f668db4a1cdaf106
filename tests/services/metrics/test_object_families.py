"""Objects through Prometheus' own text and parser."""

from __future__ import annotations

from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.registry import CollectorRegistry

from rhot.watch.rig_state import ObjectRow
from services.metrics.object_families import object_families
from services.metrics.service import Snapshot


def scraped(*rows: ObjectRow) -> dict[tuple[str, ...], float]:
    """Every sample as {(name, labels' values in order of their names): value}."""
    snapshot, registry = Snapshot(), CollectorRegistry()
    registry.register(snapshot)
    snapshot.metrics = list(object_families(rows))
    return {
        (sample.name, *(value for _, value in sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(generate_latest(registry).decode())
        for sample in family.samples
    }


def test_an_object_that_is_held() -> None:
    found = scraped(
        ObjectRow(
            object="cup",
            state="ok",
            registered=True,
            heard_ns=1,
            age_ms=12.0,
            sigma_m=0.0008,
            touching={"right": ["thumb", "index"], "left": ["palm"]},
            held_by={"right": ["thumb", "index"]},
        )
    )
    assert found["rhot_object_state", "cup", "ok"] == 1.0
    assert found["rhot_object_state", "cup", "lost"] == 0.0
    assert found["rhot_object_registered", "cup"] == 1.0
    assert found["rhot_object_age_seconds", "cup"] == 0.012
    assert found["rhot_object_sigma_meters", "cup"] == 0.0008
    assert found["rhot_object_contacts", "cup"] == 3.0
    assert found["rhot_object_held", "right", "cup"] == 2.0


def test_what_is_not_heard_has_a_state_and_nothing_else() -> None:
    found = scraped(
        ObjectRow(object="cup", state="absent"),
        ObjectRow(object="mug", state="silent", registered=True, heard_ns=1, age_ms=5.0),
    )
    assert found["rhot_object_state", "cup", "absent"] == 1.0
    assert found["rhot_object_state", "mug", "silent"] == 1.0
    assert not [name for name in found if name[0] in ("rhot_object_age_seconds",)]
    assert found["rhot_object_contacts", "cup"] == 0.0


def test_a_rig_without_objects() -> None:
    assert scraped() == {}
