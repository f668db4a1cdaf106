"""The solver: hand/<h>/points in, hand/<h>/pose out, for every hand of rig.toml.

Points that come at once have their poses all the same; a solver that is further behind skips the
oldest. Missing points: no pose is published. A hand that was never measured is solved with the
tables' bones, at the scale of rig.toml until its points show its size; health says both, and how
long a pose takes. A new hand.<hand>.json starts it anew.
"""

from __future__ import annotations

import asyncio
import time

from rhot import topics
from rhot.bus.bus import Publisher, Subscription
from rhot.errors import ConfigError
from rhot.files.calibration import load_hand
from rhot.files.config import RigConfig
from rhot.hand import HandModel, HandName
from rhot.messages import HandPoints, HandPose
from rhot.process.calibration_watch import load_and_watch
from rhot.process.service import Service
from services.solver.step import SolverStep
from services.solver.warm import warm_up

# Points of one hand that may wait: what fusion, held up by something else, tells in one go. In
# fusion's own process that is all of a burst of 32 frames: of 32 rigs at 60 fps, which are too many
# for two cores, 60 and 63 % of the poses came with 4 in turn with 86 and 83 with 16. No more: a
# solver of its own that cannot keep up is late by all that waits.
_WAITING = 16
# A challenge, which takes 2 ms, waits so long after its pose: the other hand's points come at once
# after those of this one, the next ones after 8 ms at the least.
_CHALLENGE_S = 0.002
# Weight of the newest time in the running mean: a second or so at 30 poses a second.
_MEAN_WEIGHT = 0.05


async def serve(service: Service) -> None:
    """Solves the pose of every hand from its painted landmarks."""
    config = service.config
    if not config.hand:
        raise ConfigError(
            "rig.toml has no [hand.right.markers] or [hand.left.markers]: there is no hand to solve"
        )
    files = [config.calibration_dir / f"hand.{name}.json" for name in config.hand]
    hands = load_and_watch(service, files, lambda: _load(config))
    step = SolverStep(config, hands)
    # Compiling (a minute without a cache) must not stop the heartbeat.
    await asyncio.get_running_loop().run_in_executor(None, warm_up, config, hands)
    streams = {
        name: (
            service.bus.every(topics.POINTS, _WAITING, hand=name),
            service.bus.publisher(topics.POSE, hand=name),
        )
        for name in hands
    }
    for name, model in hands.items():
        service.values[f"{name}_from_tables"] = float(model.origin == "tables")
    service.ready()
    async with asyncio.TaskGroup() as tasks:
        for name, (points, poses) in streams.items():
            tasks.create_task(_solve_hand(service, step, name, points, poses))


def _load(config: RigConfig) -> dict[HandName, HandModel]:
    """The model of every hand of the rig, from calibration/ or the tables."""
    return {
        name: load_hand(config.calibration_dir, name, table.scale)
        for name, table in config.hand.items()
    }


async def _solve_hand(
    service: Service,
    step: SolverStep,
    hand: HandName,
    points: Subscription[HandPoints],
    poses: Publisher[HandPose],
) -> None:
    """Solve one hand's points as they come, for ever."""
    mean_ms = 0.0

    def take(message: HandPoints) -> None:
        nonlocal mean_ms
        start_s = time.perf_counter()
        pose = step.step(message)
        took_ms = (time.perf_counter() - start_s) * 1e3
        if pose is not None:
            poses.put(pose)
        mean_ms += _MEAN_WEIGHT * (took_ms - mean_ms)
        service.values[f"{hand}_solve_ms"] = round(mean_ms, 3)
        size = step.size(hand)
        if size is not None:
            service.values[f"{hand}_size"] = round(size, 3)
        if step.challenge_due(hand):
            service.tasks.create_task(_challenge(step, hand))

    await points.each(take)


async def _challenge(step: SolverStep, hand: HandName) -> None:
    await asyncio.sleep(_CHALLENGE_S)
    step.challenge(hand)
