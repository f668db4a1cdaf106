"""A rig that is written reads back as itself."""

from __future__ import annotations

import msgspec
import pytest

from rhot.files.config import HandTable, ObjectTable, RigConfig, World, load_rig
from services.simulator.files.rig_toml import rig_toml


def awkward(config: RigConfig) -> RigConfig:
    """Everything that TOML could stumble over."""
    world = World(
        T_rig_from_camera=(
            (1.0, 0.0, 0.0, 1e-7),
            (0.0, 1.0, 0.0, -2.5),
            (0.0, 0.0, 1.0, 1e22),
            (0.0, 0.0, 0.0, 1.0),
        )
    )
    rig = msgspec.structs.replace(config.rig, world=world, calibration='folder "of" a\\b, ümlaut')
    hands = {
        "left": HandTable(markers={"wrist": "0.red"}, scale=0.9),
        "right": config.hand["right"],
    }
    things = [ObjectTable(name="a.b", serial="LHR-1"), ObjectTable(name="c", serial="2")]
    return msgspec.structs.replace(config, rig=rig, hand=hands, object=things)


@pytest.mark.parametrize(
    "change",
    [lambda c: c, awkward, lambda c: msgspec.structs.replace(c, hand={}, object=[], camera=[])],
)
def test_round_trip(config, tmp_path, change):
    rig = change(config)
    path = tmp_path / "rig.toml"
    path.write_text(rig_toml(rig, "made by a test"), encoding="utf-8")
    assert msgspec.structs.replace(load_rig(path), folder=rig.folder) == rig
    assert path.read_text().startswith("# made by a test\n")
