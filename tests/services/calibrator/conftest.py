"""The synthetic bench of the calibrator's tests."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from testing.synthetic_boards import Bench, BenchSetup

MakeBench = Callable[..., Bench]


@pytest.fixture(scope="session")
def make_bench() -> MakeBench:
    """Builds a Bench from the arguments of BenchSetup, each of which has a default."""
    return lambda *arguments, **named: BenchSetup(*arguments, **named).bench()
