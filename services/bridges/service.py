"""One bridge to another program: rhot-bridge --instance NAME runs services/bridges/NAME.

Off unless rig.toml says `enabled = true` under [bridges.NAME]. It subscribes to the newest message
of each hand and object alone, and what its program does not take is dropped here: a slow program
costs the rig nothing. That the program is away is a state of the bridge, no fault of the rig.
"""

from __future__ import annotations

import importlib
import logging

from rhot.process import systemd
from rhot.process.service import Service
from services.bridges.registry import module_of

log = logging.getLogger("rhot.bridge")


async def serve(service: Service) -> None:
    """Sends hands and objects to one other program (VMC, OpenXR, ROS 2, ...) as it wants them."""
    name = service.instance
    module = module_of(name)
    if not getattr(service.config.bridges, name).enabled:
        log.info(
            "the bridge %s is off; `enabled = true` under [bridges.%s] in rig.toml switches it on",
            name,
            name,
        )
        systemd.notify("READY=1")
        return
    # Only now: each needs modules of its own.
    await importlib.import_module(module).serve(service)
