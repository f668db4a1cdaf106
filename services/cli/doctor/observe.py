"""Everything `rhot doctor` looks at, one after the other, until something is in the way."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Sequence
from pathlib import Path

from rhot.bus.security.credentials import is_secured
from rhot.bus.security.tls_diagnosis import certificate_problem
from rhot.errors import BusError, CalibrationError, ConfigError
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import RigConfig
from services.cli.doctor.listen import listen
from services.cli.doctor.local_routers import router_endpoints
from services.cli.doctor.observations import Observations, Reach
from services.cli.doctor.reach import reach
from services.cli.router_session import rig_and_endpoints, router_session


async def observe(path: Path, connect: str | None) -> Observations:
    """Look at a rig; connect replaces the endpoints of rig.toml. Raises nothing."""
    seen = Observations(config_path=str(path))
    try:
        config, endpoints = rig_and_endpoints(path, connect)
    except (ConfigError, BusError) as error:
        seen.config_problem = str(error)
        return seen
    seen.config, seen.secured = config, any(map(is_secured, endpoints))
    seen.calibration_problem = _calibration_problem(config)
    if seen.secured:
        problem = await asyncio.to_thread(certificate_problem, endpoints, time.time())
        seen.certificate_problem = problem or ""
    seen.reached = list(await asyncio.gather(*(reach(endpoint) for endpoint in endpoints)))
    if all(one.problem for one in seen.reached):
        seen.routers_here = await asyncio.to_thread(router_endpoints)
        return seen
    await _compare_routers(config.rig.name, endpoints, seen.reached)
    try:
        async with router_session(config.rig.name, endpoints) as bus:
            await listen(bus, config, seen)
    except BusError:
        for one in seen.reached:
            one.problem = one.problem or "something listens there, but it is no Zenoh router"
    return seen


async def _compare_routers(rig: str, endpoints: Sequence[str], reached: Sequence[Reach]) -> None:
    """Which router answers at each endpoint, where more than one does."""
    answering = [pair for pair in zip(endpoints, reached, strict=True) if not pair[1].problem]
    if len(answering) < 2:
        return
    for endpoint, one in answering:
        with contextlib.suppress(BusError):
            async with router_session(rig, [endpoint]) as bus:
                one.router = ",".join(bus.routers)


def _calibration_problem(config: RigConfig) -> str:
    """Why fusion or solver would not start, judged by this computer's files."""
    if not config.has_depth:
        return ""
    try:
        load_rig_cameras(config)
        for hand, table in config.hand.items():
            load_hand(config.calibration_dir, hand, table.scale)
    except CalibrationError as error:
        return str(error)
    return ""
