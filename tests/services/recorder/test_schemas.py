"""The names of schemas in recordings."""

from __future__ import annotations

from rhot import topics
from services.recorder.schemas import schema_name


def test_names() -> None:
    assert schema_name(topics.MARKERS) == "rhot.MarkerFrame"
    assert schema_name(topics.PREVIEW) == ""
