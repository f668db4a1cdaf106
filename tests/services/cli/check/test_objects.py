"""`rhot check` of objects: their paint, their shapes, their registration."""

from __future__ import annotations

import shutil
from pathlib import Path

import msgspec
import pytest

from rhot.files.calibration import Objects, load_objects, save
from services.cli.check.check import check_config
from services.cli.defaults import config_dir


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """A copy of the simulated rig, with a painted fork."""
    shutil.copytree(config_dir(), tmp_path / "rig")
    return tmp_path / "rig" / "sim.toml"


def add(rig: Path, lines: str) -> None:
    rig.write_text(f'{rig.read_text()}\n[[object]]\nname = "fork"\nserial = "LHR-2"\n{lines}\n')


def found(rig: Path, severity: str) -> str:
    return "\n".join(
        f"{one.where}: {one.what}" for one in check_config(rig).problems if one.severity == severity
    )


def test_paint_without_a_range_names_who_wears_it(rig: Path) -> None:
    add(rig, 'marker = "teal"')
    assert "colour 'teal' of the fork's tracker is missing" in found(rig, "error")
    assert "rhot calibrate colors left" in found(rig, "error")


def test_a_color_of_a_hand_cannot_be_a_trackers(rig: Path) -> None:
    add(rig, 'marker = "blue"')
    assert "colour 'blue' is used 2 times" in found(rig, "error")


def test_shapes_that_do_not_fit(rig: Path) -> None:
    add(rig, 'shape = "box"\nsize_m = [0.1]')
    assert "[[object]] 'fork': size_m has 1 lengths" in found(rig, "error")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("cup.stl", None, "no such file"),
        ("cup.stl", b"solid nothing", "mesh of object 'fork'"),
        ("cup.obj", b"", "is no .glb or .stl file"),
    ],
)
def test_meshes_that_cannot_be_used(rig: Path, name: str, content: bytes | None, said: str) -> None:
    if content is not None:
        (rig.parent / name).write_bytes(content)
    add(rig, f'shape = "mesh"\nmesh = "{name}"')
    assert said in found(rig, "error")


def test_a_registration_that_does_not_know_the_paint_or_is_of_another_world(rig: Path) -> None:
    add(rig, 'marker = "teal"')
    folder = next(rig.parent.glob("calibration*"))
    before = load_objects(folder)
    unpainted = msgspec.structs.replace(before.objects["cup"], marker_m=None)
    places = before.objects | {"fork": unpainted}
    save(folder / "objects.json", msgspec.structs.replace(before, objects=places))
    assert "does not know where the teal paint is on fork's tracker" in found(rig, "note")
    assert "another [rig.world]" not in found(rig, "error")
    world = [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0, 0, 0, 1.0]]
    changed: Objects = msgspec.structs.replace(
        load_objects(folder), inputs={"T_rig_from_camera": world}
    )
    save(folder / "objects.json", changed)
    assert "was made with another [rig.world]" in found(rig, "error")
