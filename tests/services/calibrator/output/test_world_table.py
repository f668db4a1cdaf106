"""The table of `rhot calibrate world` is what rig.toml reads."""

from __future__ import annotations

import tomllib

import numpy as np

from rhot.geometry.transforms import inverse, rotation_x, transform
from services.calibrator.output.world_table import world_table
from services.calibrator.rig.world_frame import WorldFrame


def test_the_table_is_what_rig_toml_reads(make_bench):
    first = make_bench().cameras[0]
    T_world_from_rig = transform(rotation_x(2.0), [0.1, -0.2, 0.5])
    text = world_table(WorldFrame(T_world_from_rig, ("left",), 0.1), first)
    T = np.array(tomllib.loads(text)["rig"]["world"]["T_rig_from_camera"])
    np.testing.assert_allclose(T, T_world_from_rig @ first.T_rig_from_camera, atol=1e-8)
    np.testing.assert_allclose(T @ inverse(T), np.eye(4), atol=1e-8)
    assert "camera left at 0.100, -0.200, 0.500 m above the desk" in text
