"""Fusion, the master of a rig: markers of all cameras in, 3D landmarks out; it also gives the start
signal and the time.

Late frames are put in their place or counted; a missing camera leaves its landmarks `predicted`,
then absent, and the rest goes on; without calibration (lenses, rig.json) the service ends with the
command that makes it. At the end of its start it broadcasts the session; it answers queries for
session and clock, and repeats the broadcast to every tracker that comes.
"""

from __future__ import annotations

import asyncio
import time

from rhot import clock, topics
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.messages import ClockEcho
from rhot.process.service import Service
from services.fusion.session_state import SessionState
from services.fusion.step import FusionStep
from services.fusion.warm import warm_up

_REFUSAL_TEXTS = {
    "unknown_camera": "frames of a camera that rig.toml does not name are ignored",
    "wrong_size": "frames of another size than <camera>.lens.json are ignored; calibrate that camera at the size it runs at",
    "absurd_stamp": "frames with an impossible stamp are ignored",
    "astray": "frames whose clock is far off the others' are ignored; the camera's clock offset is wrong or was set",
}


async def serve(service: Service) -> None:
    """Turns the cameras' markers into 3D landmarks, and leads the rig: start broadcast and clock."""
    config = service.config
    cameras = load_rig_cameras(config)
    hands = {
        hand: load_hand(config.calibration_dir, hand, table.scale)
        for hand, table in config.hand.items()
    }
    step = FusionStep(config, cameras, hands)
    await asyncio.to_thread(warm_up, config, cameras, hands)
    publishers = {hand: service.bus.publisher(topics.POINTS, hand=hand) for hand in config.hand}
    frames = service.bus.every(topics.MARKERS, 64)
    _lead(service)
    service.tasks.create_task(_listen_to_solver(service, step))
    report = _Report(service, step)
    service.ready()
    async for frame in frames:
        began_s = time.perf_counter()
        for points in step.step(frame):
            publishers[points.hand].put(points)
        report.note(time.perf_counter() - began_s)


async def _listen_to_solver(service: Service, step: FusionStep) -> None:
    """Where the fingers point tells where in its paint a tip is."""
    async for pose in service.bus.latest(topics.POSE):
        step.note_pose(pose)


def _lead(service: Service) -> None:
    """Be the master: give the start signal, answer for session and clock."""
    state = SessionState(clock.now_ns())
    publisher = service.bus.publisher(topics.SESSION)
    broadcasts = service.bus.latest(topics.SESSION)
    arrivals = service.bus.watch_alive()
    service.bus.answer(topics.SESSION, lambda: state.session)
    service.bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=clock.now_ns()))
    publisher.put(state.session)

    async def listen() -> None:
        async for session in broadcasts:
            state.hear(session)

    async def greet() -> None:
        async for arrival in arrivals:
            if arrival.alive and arrival.service == "pi_tracker":
                publisher.put(state.session)

    service.tasks.create_task(listen())
    service.tasks.create_task(greet())


class _Report:
    """Fusion's own figures for health, renewed once a second."""

    def __init__(self, service: Service, step: FusionStep) -> None:
        self._service, self._step = service, step
        self._since_s = time.monotonic()
        self._accepted = 0
        self._busy_s: list[float] = []
        self._said: set[str] = set()
        self._moved: set[tuple[str, str]] = set()
        self._mirrored: set[tuple[str, str]] = set()

    def note(self, busy_s: float) -> None:
        """One frame took that long."""
        self._busy_s.append(busy_s)
        for reason in self._step.refusals.keys() - self._said:
            self._said.add(reason)
            if reason in _REFUSAL_TEXTS:
                self._service.error(_REFUSAL_TEXTS[reason])
        now_s = time.monotonic()
        if now_s - self._since_s >= 1.0:
            self._renew(now_s - self._since_s)
            self._since_s = now_s

    def _renew(self, elapsed_s: float) -> None:
        step, counts, values = self._step, self._step.method.counts, self._service.values
        values["observations_hz"] = (counts.accepted - self._accepted) / elapsed_s
        values["step_p50_us"] = 1e6 * sorted(self._busy_s)[len(self._busy_s) // 2]
        values["epipolar_px"] = step.clocks.epipolar_px
        self._tell_moved()
        self._tell_mirrored()
        values |= {f"late_{name}_ms": 1e3 * late_s for name, late_s in step.clocks.late_s.items()}
        values |= {
            f"height_{pair}_px": height_px for pair, height_px in step.clocks.heights_px.items()
        }
        values |= {
            name: float(getattr(counts, name))
            for name in ("gated", "late", "refused", "started", "dropped", "incoherent")
        }
        values |= {f"frames_{reason}": float(count) for reason, count in step.refusals.items()}
        self._accepted = counts.accepted
        self._busy_s.clear()

    def _tell_moved(self) -> None:
        """Report a bumped camera when it shows, and again when it shows once more."""
        moved = self._step.clocks.moved_px
        for pair in moved.keys() - self._moved:
            self._service.error(
                f"the views of cameras {pair[0]} and {pair[1]} differ by {moved[pair]:.1f} px in height: one of them has moved since the "
                f"calibration; fasten it and run `rhot calibrate stereo`"
            )
        self._moved = set(moved)
        self._service.values["moved_pairs"] = float(len(moved))

    def _tell_mirrored(self) -> None:
        mirrored = self._step.mirrors.mirrored
        for pair in mirrored.keys() - self._mirrored:
            self._service.error(
                f"the views of cameras {pair[0]} and {pair[1]} are mirror images of each other, {mirrored[pair]}: one of them has hflip or "
                f"vflip set, or lost it, since the calibration; set both as they were then"
            )
        self._mirrored = set(mirrored)
        self._service.values["mirrored_pairs"] = float(len(mirrored))
