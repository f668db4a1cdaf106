"""Paths of the synthetic people."""

from __future__ import annotations

import pytest

from studies.grasp.compare.paths import TipPath, tip_path


@pytest.fixture(scope="session")
def paths(people) -> list[TipPath]:
    """One a person."""
    return [tip_path(one.subject, one) for one in people]
