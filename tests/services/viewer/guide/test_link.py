"""What all visitors know of the calibrator: also that it was started again, and has forgotten."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from rhot.files.config import RigConfig
from rhot.messages.calibration import CalibrationState
from rhot.process.service import Service
from services.viewer.guide.link import CalibratorLink


async def test_a_calibrator_that_was_started_again_has_lost_what_it_collected(
    running: Callable, config: RigConfig
) -> None:
    async def serve(service: Service) -> None:
        service.ready()
        await asyncio.Event().wait()

    async with running("viewer", serve, config) as (service, _):
        link = CalibratorLink(service)
    states = [
        (CalibrationState(phase="collecting", number=3), False),
        (CalibrationState(phase="idle", number=0), True),
        (CalibrationState(phase="idle", number=0), True),
        (CalibrationState(phase="collecting", number=1), False),
        # Stopped by somebody: nothing is lost that anybody wanted.
        (CalibrationState(phase="idle", number=1), False),
    ]
    for state, lost in states:
        link.heard(state)
        assert (link.state, link.lost) == (state, lost)
