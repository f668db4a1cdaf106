"""Paints' colours, and what is said of missing calibration."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import trimesh

from rhot.files.calibration import ColorRange, Colors, ObjectPlace, Objects, save
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import ObjectTable
from rhot.hand import default_hand
from services.viewer.live.palette import UNKNOWN, paint_rgb
from services.viewer.setup import read_setup


def calibrated(low: int, high: int) -> list[Colors]:
    return [Colors(colors={"mine": ColorRange(hsv_low=(low, 50, 50), hsv_high=(high, 255, 255))})]


def test_paints_by_name_by_hue_or_grey() -> None:
    red, green, blue = paint_rgb("blue", [])
    assert blue > 2 * max(red, green)
    red, green, blue = paint_rgb("mine", calibrated(50, 70))  # OpenCV's hue 60 is green
    assert green > 2 * max(red, blue)
    red, green, blue = paint_rgb("mine", calibrated(170, 10))  # wraps through red
    assert red > 2 * max(green, blue)
    assert paint_rgb("mine", []) == UNKNOWN


def test_without_calibration_there_are_notes_and_no_cameras(config: RigConfig) -> None:
    setup = read_setup(config)
    assert setup.cameras == {}
    assert len(setup.notes) == 2
    assert all(
        "rig.json: no such file; make it with `rhot calibrate stereo`" in note
        for note in setup.notes
    )
    assert setup.paints["right", "index_tip"] == paint_rgb("blue", [])


def test_one_broken_camera_leaves_the_other(repository: Path, tmp_path: Path) -> None:
    rig = load_rig(repository / "config" / "sim.toml")
    whole = read_setup(rig)
    assert set(whole.cameras) == {"left", "right"}
    assert whole.notes == []
    baseline = whole.cameras["right"].centre_rig - whole.cameras["left"].centre_rig
    np.testing.assert_allclose(baseline, [0.075, 0.0, 0.0], atol=0.02)
    for path in rig.calibration_dir.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "right.lens.json").write_text("{broken")
    save(tmp_path / "right.colors.json", calibrated(1, 2)[0])
    broken = read_setup(
        msgspec.structs.replace(
            rig, folder=str(tmp_path), rig=msgspec.structs.replace(rig.rig, calibration=".")
        )
    )
    assert set(broken.cameras) == {"left"}
    assert len(broken.notes) == 1
    assert broken.notes[0].startswith("camera right is not drawn: right.lens.json:")


def test_looks_have_shape_mesh_and_tracker_and_a_broken_mesh_is_told(
    config: RigConfig, tmp_path: Path
) -> None:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "duck.stl")
    (tmp_path / "broken.glb").write_bytes(b"glTF")
    tables = [
        *config.object,
        ObjectTable(name="duck", serial="LHR-2", shape="mesh", mesh="duck.stl"),
        ObjectTable(name="blob", serial="LHR-3", shape="mesh", mesh="broken.glb"),
    ]
    rig = msgspec.structs.replace(config, object=tables, folder=str(tmp_path))
    rig.calibration_dir.mkdir()
    place = ObjectPlace(offset_m=(0.0, -0.08, 0.0))
    identity = np.eye(4).tolist()
    save(
        rig.calibration_dir / "objects.json",
        Objects(T_rig_from_lighthouse=identity, objects={"cup": place}),
    )
    setup = read_setup(rig)
    assert setup.looks["cup"].table == config.object[0]
    assert setup.looks["cup"].place == place
    assert setup.looks["duck"].mesh is not None
    assert setup.looks["duck"].place is None
    assert setup.looks["blob"].mesh is None
    (told,) = [note for note in setup.notes if "blob" in note]
    assert told.startswith("object blob is drawn as axes: broken.glb: cannot be read")


def test_limits_are_the_person_s_and_a_broken_file_is_told(
    config: RigConfig, tmp_path: Path
) -> None:
    here = msgspec.structs.replace(config, folder=str(tmp_path))
    here.calibration_dir.mkdir()
    path = here.calibration_dir / "hand.right.json"
    mine = default_hand("right", 0.9)
    save(path, mine)
    assert read_setup(here).models["right"].lengths_m.tolist() == mine.lengths_m.tolist()
    path.write_text("{broken")
    setup = read_setup(here)
    assert setup.models == {}
    assert any(
        "limits of the right hand are an average's: hand.right.json" in n for n in setup.notes
    )
