"""The calibrator: what `rhot calibrate` does with a running rig, asked for by the page.

It does nothing until somebody starts a step, does one at a time, and writes files only when
somebody says so. What goes wrong is told to who asks, and ends the step, never the service.
"""

from __future__ import annotations

import asyncio
import importlib.util

from rhot import topics
from rhot.process.service import Service
from services.calibrator.endpoints.guide import Guide

# What its steps need. They are imported as the first one starts: until then it stays small.
_NEEDED = ("cv2", "numba", "scipy")
for _name in _NEEDED:
    if importlib.util.find_spec(_name) is None:
        raise ModuleNotFoundError(f"No module named {_name!r}", name=_name)


async def serve(service: Service) -> None:
    """Answers who wants to calibrate."""
    guide = Guide(service.bus, service.config)
    service.bus.answer_requests(topics.CALIBRATE, guide.answer)
    service.ready()
    try:
        await asyncio.Event().wait()
    finally:
        await guide.close()
