"""Fusion as a service, the master of a rig: markers of all cameras in, 3D landmarks out.

As the master it also broadcasts the session and answers for session and clock. Late frames are
inserted or counted; a missing camera leaves its landmarks `predicted`, then absent, and the rest
goes on; without calibration (lenses, rig.json) the service ends with the command that makes it,
with a new one it starts anew. A rig that tracks markers only has a master all the same.
"""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

from rhot import clock, topics
from rhot.bus.master_clock import watch_masters
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandModel, HandName
from rhot.messages import ClockEcho, MarkerFrame
from rhot.process.calibration_watch import load_and_watch
from rhot.process.computer.watch import watch_computer
from rhot.process.service import Service
from services.fusion.faults import FusionFaults
from services.fusion.health import HealthFigures
from services.fusion.session_state import SessionState
from services.fusion.step import FusionStep
from services.fusion.warm import warm_up

_LOOK_S = 1.0
# What points do not wait for is done so long after them: by then their pose is out, and who made it
# had the processor. (At once, poses came .2 times a bare message's way later.)
_SETTLE_S = 0.002
# A frame that has waited for so long waited for other rigs', or other programs have the processor.
_BEHIND_S = 0.005
# A second master is there to stay; trackers, which ask each second, name it sooner.
_ASK_MASTERS_S = 5.0


async def serve(service: Service) -> None:
    """Turns the cameras' markers into 3D landmarks, and is the master of session and clock."""
    config = service.config
    if not config.has_depth:
        await _serve_without_depth(service)
    cameras, hands = load_and_watch(service, _calibration_files(config), lambda: _load(config))
    step = FusionStep(config, cameras, hands)
    await asyncio.to_thread(warm_up, config, cameras, hands)
    publishers = {hand: service.bus.publisher(topics.POINTS, hand=hand) for hand in config.hand}
    names = [camera.name for camera in config.camera]
    frames = service.bus.in_time(topics.MARKERS, 64, names)
    state = _serve_session_and_clock(service)
    service.tasks.create_task(_note_poses(service, step))
    service.tasks.create_task(watch_computer(service))
    health = HealthFigures(step, service.values, time.monotonic())
    service.tasks.create_task(_look_every_second(service, step, health, state))
    service.ready()
    loop = asyncio.get_running_loop()

    def take(frame: MarkerFrame) -> None:
        began_s = time.perf_counter()
        for points in step.step(frame):
            publishers[points.hand].put(points)
        if frames.waited_s > _BEHIND_S:
            step.settle(behind=True)
        else:
            loop.call_later(_SETTLE_S, step.settle)
        health.note_frame(time.perf_counter() - began_s)

    await frames.each(take)


async def _look_every_second(
    service: Service, step: FusionStep, health: HealthFigures, state: SessionState
) -> None:
    """Figures and faults, also while no frame comes."""
    faults = FusionFaults(step, service.config, service.faults, time.monotonic())
    while True:
        await service.turn(_LOOK_S)
        health.renew(time.monotonic())
        faults.look(time.monotonic(), session_running=state.session.running)


def _calibration_files(config: RigConfig) -> list[Path]:
    lenses = [f"{camera.name}.lens.json" for camera in config.camera]
    hands = [f"hand.{hand}.json" for hand in config.hand]
    return [config.calibration_dir / name for name in ("rig.json", *lenses, *hands)]


def _load(config: RigConfig) -> tuple[dict[str, Camera], dict[HandName, HandModel]]:
    """Cameras and hands of the rig, from calibration/."""
    hands = {
        hand: load_hand(config.calibration_dir, hand, table.scale)
        for hand, table in config.hand.items()
    }
    return load_rig_cameras(config), hands


async def _serve_without_depth(service: Service) -> None:
    """Be the master of a rig that tracks markers only, for ever."""
    _serve_session_and_clock(service)
    service.ready()
    await asyncio.Event().wait()


async def _note_poses(service: Service, step: FusionStep) -> None:
    """Where the fingers point tells where in its paint a tip is."""
    poses = service.bus.latest(topics.POSE)
    poses.patience_s = _SETTLE_S
    await poses.each(step.note_pose)


def _serve_session_and_clock(service: Service) -> SessionState:
    """Be the master: broadcast the session, answer for session and clock.

    The broadcast is repeated to every tracker that comes.
    """
    state = SessionState(clock.now_ns())
    publisher = service.bus.publisher(topics.SESSION)
    broadcasts = service.bus.latest(topics.SESSION)
    arrivals = service.bus.watch_alive()
    service.bus.answer(topics.SESSION, lambda: state.session)
    began_ns = time.monotonic_ns()

    def echo() -> ClockEcho:
        uptime_ns = time.monotonic_ns() - began_ns
        return ClockEcho(master_ns=clock.now_ns(), session=me, host=host, uptime_ns=uptime_ns)

    me, host = service.bus.session, service.host
    service.bus.answer(topics.CLOCK, echo)
    publisher.put(state.session)

    async def follow_broadcasts() -> None:
        async for session in broadcasts:
            state.update(session)

    async def repeat_to_trackers() -> None:
        async for arrival in arrivals:
            if arrival.alive and arrival.service == "pi_tracker":
                publisher.put(state.session)

    async def ask_later() -> None:
        await service.turn(_ASK_MASTERS_S)

    service.tasks.create_task(follow_broadcasts())
    service.tasks.create_task(repeat_to_trackers())
    service.tasks.create_task(
        watch_masters(service.bus, clock.now_ns, service.second_clock, ask_later)
    )
    return state
