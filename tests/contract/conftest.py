"""Two sessions of one rig."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from rhot.bus.bus import Bus, open_bus


@pytest.fixture
async def pair(router: str) -> AsyncIterator[tuple[Bus, Bus]]:
    """Both on a real router."""
    async with open_bus("test", [router]) as one, open_bus("test", [router]) as other:
        yield one, other
