"""The solver: hand/<h>/points in, hand/<h>/pose out, for every hand of rig.toml.

Only the newest points count (latest): a solver that is behind skips. Missing points: no pose is published. A hand that was never
measured is solved with the tables' bones at the scale of rig.toml, and health says so.
"""

from __future__ import annotations

import asyncio
from functools import partial

from rhot import topics
from rhot.calibration import load_hand
from rhot.errors import ConfigError
from rhot.hand import HandModel, HandName
from rhot.service import Service
from services.solver.step import SolverStep
from services.solver.warm import warm_up


async def serve(service: Service) -> None:
    """Solves the pose of every hand from its painted landmarks."""
    config = service.config
    if not config.hand:
        raise ConfigError("rig.toml has no [hand.right.markers] or [hand.left.markers]: there is no hand to solve")
    hands: dict[HandName, HandModel] = {name: load_hand(config.calibration_dir, name, table.scale) for name, table in config.hand.items()}
    # Compiling (2 s without a cache) must not stop the heart beat.
    await asyncio.get_running_loop().run_in_executor(None, partial(warm_up, config, hands))
    async with asyncio.TaskGroup() as tasks:
        for name in hands:
            tasks.create_task(_follow(service, SolverStep(config, {name: hands[name]}), name))
        for name, model in hands.items():
            if model.origin == "tables":
                service.values[f"{name}_from_tables"] = 1.0
        service.ready()


async def _follow(service: Service, step: SolverStep, hand: HandName) -> None:
    """One hand, for ever."""
    publisher = service.bus.publisher(topics.POSE, hand=hand)
    async for points in service.bus.latest(topics.POINTS, hand=hand):
        pose = step.step(points)
        if pose is not None:
            publisher.put(pose)
