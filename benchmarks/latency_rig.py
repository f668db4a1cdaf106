"""The rig of benchmarks/latency.py: frames of markers, real services, bare relays, one router."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, default_hand, forward, landmark_point
from rhot.messages import HandPoints, HandPose, MarkerFrame
from services.fusion.step import FusionStep
from services.solver.step import SolverStep
from testing.loopback import free_port
from testing.synthetic_points import COLORS, SyntheticRig, frames

RIG = "latency"
# Hops of a bare message: as many as from a marker to a pose.
BARE_KEYS = ("latency-bare/markers", "latency-bare/points", "latency-bare/pose")
_HERE = Path(__file__).parent
_MODEL = default_hand("right")
# A router listens after a second or two.
_ROUTER_S = 30.0
# The wrist of a hand that is held up before the cameras, palm towards them.
_HELD_UP = rotation_from_vector(np.array([1.2, 0.3, 0.1]))
# Speed of the sways and of the closing, rad/s.
_SWAYS, _CLOSES = np.array([2.1, 3.3, 2.7]), 3.0


def closing_hand(times_s: Array) -> Array:
    """Landmarks (n, 6, 3) of a right hand that closes and opens every 2 s and sways, at (n,) or
    (n, 6) seconds.
    """
    times = np.asarray(times_s, dtype=np.float64).reshape(len(times_s), -1)
    times = np.broadcast_to(times, (len(times_s), 6))
    return np.array([[_landmark(row[k], k) for k in range(6)] for row in times.tolist()])


def _landmark(seconds: float, k: int) -> Array:
    low, high = _MODEL.limits_rad[..., 0], _MODEL.limits_rad[..., 1]
    share = 0.5 - 0.35 * np.cos(_CLOSES * seconds)
    angles = low + share * (high - low)
    angles[:, 0] = 0.5 * (low + high)[:, 0]
    turn = rotation_from_vector(0.1 * np.sin(_SWAYS * seconds))
    position = np.array([0.03, 0.03, 0.55]) + 0.02 * np.sin(_SWAYS[::-1] * seconds)
    joints = forward(_MODEL, _HELD_UP @ turn, position, angles)
    return landmark_point(_MODEL, BASIC_LANDMARKS[k], *joints)


@dataclass(frozen=True)
class Recording:
    """Frames of a rig, in the order of their exposure, and what the pure steps make of them."""

    rig: SyntheticRig
    frames: list[MarkerFrame]
    points: list[HandPoints | None]  # what each frame tells, if anything
    poses: list[HandPose | None]

    @property
    def example(self) -> tuple[bytes, bytes, bytes]:
        """A frame, points and a pose as bytes, from the end of the recording."""
        told = [n for n, pose in enumerate(self.poses) if pose is not None][-1]
        messages = self.frames[told], self.points[told], self.poses[told]
        frame, points, pose = (msgspec.json.encode(message) for message in messages)
        return frame, points, pose


def record(fps: float, seconds: float) -> Recording:
    """Two free-running cameras half a period apart, .06 px of noise, no frame lost."""
    rig = SyntheticRig(
        fps=fps, phase_s=0.5 / fps, loss=0.0, skew_s=0.0, drift_ppm=0.0, row_time_ns=8000.0
    )
    shown = frames(rig, closing_hand, seconds)
    fusion = FusionStep(rig.config(), rig.rig(), {"right": _MODEL})
    solver = SolverStep(rig.config(), {"right": _MODEL})
    told = [next(iter(fusion.step(frame)), None) for frame in shown]
    poses = [None if points is None else solver.step(points) for points in told]
    return Recording(rig, shown, told, poses)


def write_rig(folder: Path, rig: SyntheticRig) -> Path:
    """rig.toml and the calibration for the services; the path of the former."""
    cameras = "".join(
        f'[[camera]]\nname = "{name}"\nsource = "simulator"\nfps = {rig.fps}\n'
        for name in rig.names
    )
    colors = zip(BASIC_LANDMARKS, COLORS, strict=True)
    markers = "\n".join(f'{landmark} = "{color}"' for landmark, color in colors)
    path = folder / "rig.toml"
    path.write_text(f'[rig]\nname = "{RIG}"\n{cameras}[hand.right.markers]\n{markers}\n')
    rig.save_calibration(folder / "calibration")
    return path


@contextlib.contextmanager
def running(folder: Path, recording: Recording, *, apart: bool, direct: bool) -> Iterator[str]:
    """The router, fusion with the solver and two bare relays as processes; the router's endpoint.

    apart: the solver has a process of its own. direct: peers without a router; the endpoint is that
    of their hub.
    """
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    rig = str(write_rig(folder, recording.rig))
    common = ("--config", rig, "--connect", endpoint)
    _, points, pose = recording.example
    (folder / "points").write_bytes(points)
    (folder / "pose").write_bytes(pose)
    peer = str(_HERE / "latency_peer.py")
    run = (peer,) if direct else ("-m",)
    commands = [
        (peer, "hub", endpoint)
        if direct
        else ("-m", "services.cli", "router", "--listen", endpoint),
        (*run, "services.fusion", *([] if apart else ["--solve"]), *common),
        *([(*run, "services.solver", *common)] if apart else []),
        (*run, "latency_relay", endpoint, *BARE_KEYS[:2], str(folder / "points")),
        (*run, "latency_relay", endpoint, *BARE_KEYS[1:], str(folder / "pose")),
    ]
    # Modules of this folder, beside those that the caller finds.
    path = os.pathsep.join([str(_HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
    with contextlib.ExitStack() as stack:
        log = stack.enter_context((folder / "log").open("wb"))
        for command in commands:
            process = subprocess.Popen(
                [sys.executable, *command],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                # One thread, as `rhot up` has it.
                env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
            )
            stack.enter_context(process)
            stack.callback(process.terminate)
            _wait_for(port)
        yield endpoint


def _wait_for(port: int) -> None:
    """Wait until a router listens."""
    deadline_s = time.monotonic() + _ROUTER_S
    while time.monotonic() < deadline_s:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise SystemExit("the router did not start")
