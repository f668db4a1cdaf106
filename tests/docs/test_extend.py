"""The examples of docs/extend.md, taken from the page and run."""

from __future__ import annotations

import asyncio
import re
import sys
import types

import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, Solver
from rhot.hand import default_hand
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from rhot.messages.objects import Grasp, ObjectContacts
from testing.source_tree import ROOT

PAGE = (ROOT / "docs" / "extend.md").read_text(encoding="utf-8")
MAX_LINES = 40


def blocks(heading: str) -> list[str]:
    """The Python blocks of a section."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    found = re.findall(r"^```python\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    assert found, f"no example under {heading!r}"
    return found


@pytest.fixture
def module(monkeypatch) -> types.ModuleType:
    """A module for an example: message classes look their names up in theirs."""
    made = types.ModuleType("extend_example")
    monkeypatch.setitem(sys.modules, made.__name__, made)
    return made


def run(module: types.ModuleType, *headings: str) -> None:
    for heading in headings:
        for block in blocks(heading):
            exec(compile(block, "docs/extend.md", "exec"), module.__dict__)


def test_the_examples_are_short():
    for block in re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
        lines = [line for line in block.splitlines() if line.strip()]
        assert len(lines) <= MAX_LINES, f"{len(lines)} lines: {lines[0]}"


def test_a_camera_source(module, monkeypatch):
    from services.pi_tracker import sources

    monkeypatch.setattr(sources, "READERS", dict(sources.READERS))
    module.READERS, module.SourceKind = sources.READERS, sources.SourceKind
    run(module, "A camera source")
    table = CameraTable(name="left", source="pattern:40", size_px=(320, 240))
    assert sources.is_file(table)
    reader = sources.open_reader(table, RigConfig(camera=[table]), start_ns=1000)
    reader.open()
    first, second = reader.read(), reader.read()
    reader.close()
    assert first.image.shape == (240, 320, 3)
    assert (first.stamp_ns, second.seq) == (1000, first.seq + 1)
    assert not np.array_equal(first.image, second.image)
    wrong = CameraTable(name="left", source="pattern:wide")
    with pytest.raises(ConfigError, match="pattern:WIDTH"):
        sources.open_reader(wrong, RigConfig())


async def test_a_program_that_knows_what_is_held(module, router, sending):
    run(module, "A program that knows what is held")
    second = 10**9
    held = Grasp(hand="right", parts=["thumb", "index"], since_ns=second)
    ended = msgspec.structs.replace(held, until_ns=3 * second)
    frame = 0

    def message(stamp_ns: int, **fields) -> ObjectContacts:
        fields = {"contacts": [], "grasps": [], "ended": []} | fields
        return ObjectContacts(object="cup", seq=0, stamp_ns=stamp_ns, **fields)

    async with open_bus("desk", [router]) as bus:
        contacts = bus.publisher(topics.CONTACTS, object="cup")

        def send() -> None:
            nonlocal frame
            frame += 1
            # Held first, until the program must have heard of it; then let go.
            fields = {"grasps": [held]} if frame < 50 else {"ended": [ended]}
            contacts.put(message(frame * second, **fields))

        with sending(send):
            found = await asyncio.wait_for(module.count_grasps(router, 1), 60.0)
    assert found == {"cup": pytest.approx(2.0)}


def pose_with(thumb_m: float, index_m: float) -> HandPose:
    places = {"thumb_tip": (thumb_m, 0.0, 0.5), "index_tip": (index_m, 0.0, 0.5)}
    names = [*places, *(f"joint{k}" for k in range(24))]
    still = (1.0, 0.0, 0.0, 0.0)
    joints = [
        HandJoint(
            name=name,
            position_m=places.get(name, (0.0, 0.0, 0.0)),
            orientation_wxyz=still,
            radius_m=0.01,
            source="solved",
        )
        for name in names
    ]
    fingers = [
        FingerPose(
            name=name,
            angles_rad=FingerAngles(abduction=0.0, mcp=0.0, pip=0.0, dip=0.0),
            residual_m=0.0,
            iterations=1,
            status="solved",
        )
        for name in ("thumb", "index", "middle", "ring", "little")
    ]
    return HandPose(
        hand="right",
        seq=1,
        stamp_ns=7,
        method="dls",
        wrist=WristPose(position_m=(0.0, 0.0, 0.5), orientation_wxyz=still),
        joints=joints,
        fingers=fingers,
    )


async def test_a_topic_and_a_service(module, running):
    run(module, "A topic", "A service")
    config = RigConfig(hand={"right": HandTable(markers={"index_tip": "blue"})})
    async with running("pinch", module.serve, config) as (_, bus):
        pinches = bus.every(module.PINCH, 8)
        poses = bus.publisher(topics.POSE, hand="right")
        while not poses.wanted:
            await asyncio.sleep(0.01)
        poses.put(pose_with(0.10, 0.13))
        pinch = await anext(pinches)
    assert (pinch.hand, pinch.stamp_ns) == ("right", 7)
    assert pinch.distance_m == pytest.approx(0.03)


def test_a_solver_method(module, monkeypatch):
    from services.solver.finger import solve_fingers as fingers
    from services.solver.finger.outcome import SOLVED
    from services.solver.maths.chains import digit_chain, hand_chains

    monkeypatch.setattr(fingers, "METHODS", dict(fingers.METHODS))
    module.METHODS = fingers.METHODS
    run(module, "A solver method")
    chains = hand_chains(default_hand("right"))
    truth = np.tile([0.05, 0.6, 0.7, 0.4], (5, 1))
    chain = digit_chain(chains, 1)
    canonical = module.tip_position(chain, truth[1])
    side = np.array([chains.side, 1.0, 1.0])
    point = chains.base_m[1] + chains.base_rotation[1] @ (side * canonical)
    seen = np.array([0, fingers.MEASURED, 0, 0, 0])
    tips = fingers.Tips(np.tile(point, (5, 1)), np.full(5, 1e-3), seen)
    start = np.tile([0.0, 0.3, 0.3, 0.2], (5, 1))
    settings = Solver(method="trust-region", tolerance_m=1e-5)
    found = fingers.solve_fingers(settings, chains, start, tips)
    assert found.status[1] == SOLVED
    assert found.ends[1, 1] < 1e-5
