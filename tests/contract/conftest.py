"""Two sessions of one rig."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from rhot.bus.bus import Bus, open_bus
from rhot.bus.intake.rounds import Rounds


@pytest.fixture(params=["called back", "in rounds"])
async def pair(router: str, request: pytest.FixtureRequest) -> AsyncIterator[tuple[Bus, Bus]]:
    """Both on a real router; the second is called back, or asks in rounds."""
    rounds = Rounds() if request.param == "in rounds" else None
    async with (
        open_bus("test", [router]) as one,
        open_bus("test", [router], rounds=rounds) as other,
    ):
        yield one, other
