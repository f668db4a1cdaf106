"""A rig that is written reads back as itself."""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.files import rig_tables as tables
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import HandTable, ObjectTable, World
from rhot.files.simulator_table import Simulator
from rhot.hand import LANDMARKS
from services.simulator.files.rig_toml import rig_toml

# As rhot.messages.Name allows them.
NAMES = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", fullmatch=True)
# Anything a TOML string can hold; surrogates have no UTF-8.
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=40)
TINY = sys.float_info.min


def numbers(low: float, high: float = math.inf, *, whole: bool = False) -> st.SearchStrategy:
    """Numbers from low to high, often the bounds themselves or awkward ones."""
    if whole:
        return st.sampled_from([int(low), int(high)]) | st.integers(int(low), int(high))
    awkward = [v for v in (low, high, TINY, 1e-7, 0.1, 1.0, 1e16, 1e22) if low <= v <= high]
    return st.sampled_from(awkward) | st.floats(low, high)


def unique(values: st.SearchStrategy, most: int) -> st.SearchStrategy:
    return st.lists(values, max_size=most, unique=True)


def rig_tables() -> st.SearchStrategy[tables.RigTable]:
    row = st.tuples(*[numbers(-1e300, 1e300)] * 4)
    worlds = st.builds(World, T_rig_from_camera=st.tuples(row, row, row, row))
    return st.builds(tables.RigTable, name=NAMES, calibration=TEXTS, world=st.none() | worlds)


def camera_tables(name: str) -> st.SearchStrategy[tables.CameraTable]:
    pixels = numbers(16, 8192, whole=True)
    return st.builds(
        tables.CameraTable,
        name=st.just(name),
        source=TEXTS,
        fps=numbers(TINY, 240.0),
        size_px=st.tuples(pixels, pixels),
        sync=st.sampled_from(["off", "server", "client"]),
        host=TEXTS,
    )


@st.composite
def hand_tables(draw: st.DrawFn) -> dict[str, HandTable]:
    """One hand, two or none, no colour twice."""
    landmarks = draw(unique(st.sampled_from(LANDMARKS), 6))
    colors = draw(st.lists(NAMES, min_size=6, max_size=6, unique=True))
    hands = {}
    for hand, part in (("left", slice(0, 3)), ("right", slice(3, 6))):
        markers = dict(zip(landmarks[part], colors[part], strict=False))
        if markers:
            hands[hand] = HandTable(markers=markers, scale=draw(numbers(0.4, 1.6)))
    return hands


@st.composite
def object_tables(draw: st.DrawFn) -> list[ObjectTable]:
    serials = draw(st.lists(NAMES, min_size=3, max_size=3, unique=True))
    names = draw(unique(NAMES, 3))
    pairs = zip(names, serials, strict=False)
    return [ObjectTable(name=name, serial=serial) for name, serial in pairs]


# Every bounded number and every free text of the other tables.
OTHER_TABLES = {
    "tracker": st.builds(
        tables.Tracker,
        roi_margin_px=numbers(0, 500, whole=True),
        rectify=st.booleans(),
        gaussian_px=numbers(0, 31, whole=True),
        min_area_px=numbers(0.0),
        max_area_px=numbers(TINY),
    ),
    "fusion": st.builds(
        tables.Fusion,
        hold_s=numbers(0.0, 2.0),
        one_euro=st.builds(tables.OneEuro, mincutoff_hz=numbers(TINY), beta=numbers(0.0)),
        disparity=st.builds(
            tables.Disparity, k=numbers(TINY), z=numbers(-3.0, -0.1), phi_rad=numbers(-0.5, 0.5)
        ),
    ),
    "solver": st.builds(
        tables.Solver, max_iterations=numbers(1, 1000, whole=True), tolerance_m=numbers(TINY)
    ),
    "objects": st.builds(tables.Objects, source=TEXTS, rate_hz=numbers(TINY, 1000.0)),
    "simulator": st.builds(
        Simulator,
        scene=TEXTS,
        seed=numbers(0, 2**63 - 1, whole=True),
        speed=numbers(TINY, 10.0),
    ),
    "viewer": st.builds(
        tables.Viewer, port=numbers(0, 65535, whole=True), rate_hz=numbers(TINY, 60.0)
    ),
    "recorder": st.builds(tables.Recorder, folder=TEXTS, autostart=st.booleans()),
}


@st.composite
def rigs(draw: st.DrawFn) -> RigConfig:
    """Any valid rig.toml."""
    endpoints = st.lists(TEXTS, max_size=3).map(tuple)
    return RigConfig(
        rig=draw(rig_tables()),
        bus=draw(st.builds(tables.Bus, connect=endpoints, listen=endpoints)),
        camera=[draw(camera_tables(name)) for name in draw(unique(NAMES, 3))],
        hand=draw(hand_tables()),
        object=draw(object_tables()),
        **{name: draw(strategy) for name, strategy in OTHER_TABLES.items()},
    )


def reread(rig: RigConfig, folder: Path) -> RigConfig:
    """Written and read back, as if from the folder it came from."""
    path = folder / "rig.toml"
    path.write_text(rig_toml(rig, "made by a test"), encoding="utf-8")
    return msgspec.structs.replace(load_rig(path), folder=rig.folder)


@settings(max_examples=60, deadline=None)
@given(rig=rigs())
def test_any_valid_rig_reads_back_as_itself(rig: RigConfig):
    with tempfile.TemporaryDirectory() as folder:
        assert reread(rig, Path(folder)) == rig


def awkward(config: RigConfig) -> RigConfig:
    """Everything that TOML could misread."""
    world = World(
        T_rig_from_camera=(
            (1.0, 0.0, 0.0, 1e-7),
            (0.0, 1.0, 0.0, -2.5),
            (0.0, 0.0, 1.0, 1e22),
            (0.0, 0.0, 0.0, 1.0),
        )
    )
    folder = 'folder "of" a\\b,\n\ttwo lines, \x7f\x00, ümlaut, \U0001f590 #'
    rig = msgspec.structs.replace(config.rig, world=world, calibration=folder)
    hands = {
        "left": HandTable(markers={"wrist": "0.red"}, scale=0.9),
        "right": config.hand["right"],
    }
    objects = [ObjectTable(name="a.b", serial="LHR-1"), ObjectTable(name="c", serial="2")]
    return msgspec.structs.replace(config, rig=rig, hand=hands, object=objects)


@pytest.mark.parametrize(
    "change",
    [lambda c: c, awkward, lambda c: msgspec.structs.replace(c, hand={}, object=[], camera=[])],
)
def test_round_trip(config, tmp_path, change):
    rig = change(config)
    assert reread(rig, tmp_path) == rig
    assert (tmp_path / "rig.toml").read_text().startswith("# made by a test\n")
