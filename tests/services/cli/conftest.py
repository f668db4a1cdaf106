"""A hand whose truth is known in closed form, and one short capture rendered once for all tests of
this room.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.files.capture import read_lines
from rhot.files.config import load_rig
from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_vector, rotation_x
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, HandModel, default_hand, forward, joint_radii_m
from rhot.messages import (
    FingerAngles,
    FingerPose,
    HandJoint,
    HandPoints,
    HandPose,
    MarkerFrame,
    WristPose,
)
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.cli.defaults import sim_toml
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run
from services.recorder.recorder import attachments
from services.recorder.writer import RecordingWriter
from services.simulator.files.capture_writer import write_capture
from services.simulator.scene.scene import load_scene

START_NS = 1_700_000_000_000_000_000
MadeOnce = Callable[[str, Callable[[Path], object]], Path]


@dataclass(frozen=True)
class MadeUpHand:
    """A right hand that waves and bends, as exact functions of time."""

    model: HandModel

    def state(self, t_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """wrist rotation (3, 3), wrist position (3,), angles (5, 4)."""
        rotation = rotation_from_vector(
            (0.3 * np.sin(2.1 * t_s), 0.2 * np.cos(1.7 * t_s), 0.1 * t_s)
        ) @ rotation_x(-0.5 * np.pi)
        position = np.array(
            [
                0.02 + 0.05 * np.sin(3.0 * t_s),
                0.03 * np.cos(2.0 * t_s),
                0.5 + 0.04 * np.sin(2.5 * t_s),
            ]
        )
        low, high = self.model.limits_rad[:, :, 0], self.model.limits_rad[:, :, 1]
        return (
            rotation,
            position,
            low + (high - low) * (0.5 + 0.3 * np.sin(4.0 * t_s + np.arange(20).reshape(5, 4))),
        )

    def truth(self, t_s: float) -> Truth:
        rotation, position, angles = self.state(t_s)
        joints, _ = forward(self.model, rotation, position, angles)
        hand = HandTruth(
            points_m={name: tuple(row) for name, row in zip(JOINTS, joints.tolist(), strict=True)},
            wrist=WristPose(
                position_m=tuple(position.tolist()),
                orientation_wxyz=tuple(quaternion_from_rotation(rotation).tolist()),
            ),
            angles_rad={digit: finger_angles(row, angles[row]) for row, digit in enumerate(DIGITS)},
        )
        cup = ObjectTruth(
            position_m=tuple((position + 0.1).tolist()),
            orientation_wxyz=hand.wrist.orientation_wxyz,
        )
        return Truth(
            stamp_ns=START_NS + round(t_s * 1e9), hands={"right": hand}, objects={"cup": cup}
        )

    def truths(self, seconds: float = 3.0, hz: float = 30.0) -> list[Truth]:
        return [self.truth(i / hz) for i in range(round(seconds * hz))]

    def pose(
        self,
        t_s: float,
        *,
        shift_m=(0.0, 0.0, 0.0),
        late_s: float = 0.0,
        off_rad=None,
        turn_rad: float = 0.0,
    ) -> HandPose:
        """The pose at t_s with known errors: shifted, late in content, angles off, hand turned
        about its own x.
        """
        rotation, position, angles = self.state(t_s - late_s)
        angles = angles if off_rad is None else angles + off_rad
        wxyz = tuple(quaternion_from_rotation(rotation @ rotation_x(turn_rad)).tolist())
        joints, turns = forward(self.model, rotation, position + np.array(shift_m), angles)
        return HandPose(
            hand="right",
            seq=round(t_s * 1000),
            stamp_ns=START_NS + round(t_s * 1e9),
            method="made up",
            wrist=WristPose(
                position_m=tuple((position + np.array(shift_m)).tolist()), orientation_wxyz=wxyz
            ),
            joints=[
                HandJoint(
                    name=name,
                    position_m=tuple(joints[i].tolist()),
                    orientation_wxyz=tuple(quaternion_from_rotation(turns[i]).tolist()),
                    radius_m=float(joint_radii_m(self.model)[i]),
                    source="solved",
                )
                for i, name in enumerate(JOINTS)
            ],
            fingers=[
                FingerPose(
                    name=digit,
                    angles_rad=finger_angles(row, angles[row]),
                    residual_m=0.001,
                    iterations=3,
                    status="solved",
                )
                for row, digit in enumerate(DIGITS)
            ],
        )

    def poses(self, seconds: float = 3.0, hz: float = 30.0, **errors) -> list[HandPose]:
        return [self.pose(i / hz, **errors) for i in range(round(seconds * hz))]


def finger_angles(row: int, angles: np.ndarray) -> FingerAngles:
    return FingerAngles(
        **{"pip": 0.0, **dict(zip(DIGIT_ANGLES[row], angles.tolist(), strict=True))}
    )


@pytest.fixture(scope="session")
def made_up() -> MadeUpHand:
    """See MadeUpHand."""
    return MadeUpHand(default_hand("right"))


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> MadeOnce:
    """`made_once(name, make)`: the folder that make(folder) filled, in whichever of the processes
    that share the tests came first; the others wait for it.
    """
    # Of all of them; without pytest-xdist it is this one's alone.
    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root

    def folder_of(name: str, make: Callable[[Path], object]) -> Path:
        folder = root / "made-once" / name / name
        folder.parent.mkdir(parents=True, exist_ok=True)
        with (folder.parent / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (folder.parent / "done").exists():
                make(folder)
                (folder.parent / "done").touch()
        return folder

    return folder_of


def simulated(folder: Path, seconds: float) -> Path:
    """`fist`, seed 1, of the simulated rig."""
    write_capture(load_scene(load_rig(sim_toml()), "fist", 1), seconds, folder)
    return folder


@pytest.fixture(scope="session")
def capture(made_once: MadeOnce) -> Path:
    """Two seconds of the simulated rig. Do not write into it."""
    return made_once("capture", lambda folder: simulated(folder, 2.0))


@pytest.fixture(scope="session")
def short_capture(made_once: MadeOnce) -> Path:
    """Half a second of it, for tests that break something. Do not write into it."""
    return made_once("short", lambda folder: simulated(folder, 0.5))


@pytest.fixture
def copy(short_capture: Path, tmp_path: Path) -> Path:
    """The short capture, to break."""
    return Path(shutil.copytree(short_capture, tmp_path / "capture"))


@pytest.fixture(scope="session")
def result(capture: Path, made_once: MadeOnce) -> Path:
    """The capture, tracked. Do not write into it."""
    return made_once("result", lambda folder: run(job_of([str(capture)], None), folder))


_STREAMS = (
    (topics.MARKERS, MarkerFrame, "markers", "camera"),
    (topics.POINTS, HandPoints, "points", "hand"),
    (topics.POSE, HandPose, "poses", "hand"),
    (topics.OBJECT, ObjectPose, "objects", "object"),
    (topics.CONTACTS, ObjectContacts, "contacts", "object"),
)


@pytest.fixture(scope="session")
def recording(capture: Path, result: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result's messages and the capture's truth, as `rhot record` keeps them."""
    path = tmp_path_factory.mktemp("recorded") / "r.mcap"
    found: list[tuple[int, topics.Topic, str, bytes]] = []
    for topic, kind, stream, field in _STREAMS:
        for message in read_lines(result / f"{stream}.jsonl", kind):
            key = topic.key("desk", **{field: getattr(message, field)})
            found.append((message.stamp_ns, topic, key, msgspec.json.encode(message)))
    for line in read_lines(capture / "truth.jsonl", Truth):
        key = topics.TRUTH.key("desk")
        found.append((line.stamp_ns, topics.TRUTH, key, msgspec.json.encode(line)))
    found.sort(key=lambda one: one[0])
    with RecordingWriter(path, "desk", "1", attachments(load_rig(capture / "rig.toml"))) as writer:
        for stamp_ns, topic, key, payload in found:
            writer.add(topic, key, payload, stamp_ns)
    return path
