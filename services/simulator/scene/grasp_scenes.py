"""Families of grasps: other hands, cups, sides and times with each random seed. Pure but for the
files a scene reads.

What is tuned on even seeds is measured on odd ones.
"""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from services.simulator.hands.families import varied_hand
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import Scene, build_scene

# Diameter and height of cups.
_DIAMETER_M, _HEIGHT_M = (0.03, 0.08), (0.11, 0.13)


def varied_cup(table: ObjectTable, seed: int) -> ObjectTable:
    """The object as a cup of that seed."""
    rng = np.random.default_rng([seed, 59])
    size_m = (float(rng.uniform(*_DIAMETER_M)), float(rng.uniform(*_HEIGHT_M)))
    return msgspec.structs.replace(table, shape="cylinder", size_m=size_m, mesh="")


def grasp_scene(config: RigConfig, seed: int, *, touch: bool = True) -> Scene:
    """A hand that takes a cup, or closes 10 mm beside it; both of that seed.

    The scene's own config has the cup. Raises ConfigError for a rig without object or hand.
    """
    if not config.object or not config.hand:
        raise ConfigError("a grasp needs an [[object]] and a [hand.right.markers] in rig.toml")
    name = "grab" if touch else "pass_by"
    hand = next(iter(config.hand))
    varied = msgspec.structs.replace(
        config, object=[varied_cup(config.object[0], seed), *config.object[1:]]
    )
    models = {hand: varied_hand(hand, seed)}
    return build_scene(varied, SCENES[name], name, seed, config.simulator.speed, models)
