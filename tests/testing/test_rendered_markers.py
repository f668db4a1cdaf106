"""Rendered hands through the tracker: markers of all cameras where the paint is."""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import load_hand
from rhot.files.config import load_rig
from rhot.hand import landmark_point
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import build_scene
from testing.rendered_markers import detect
from testing.synthetic_points import START_NS


def test_markers_are_where_the_paint_is(repository):
    config = load_rig(repository / "config" / "sim.toml")
    scene = build_scene(config, SCENES["still"], "still", 1)
    given = detect(config, scene, 0.2)
    assert {frame.camera for frame in given} == set(scene.cameras)
    assert len(given) == 12
    model = load_hand(config.calibration_dir, "right", config.hand["right"].scale)
    for frame in given:
        at_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        assert -0.1 < at_s < 0.3
        joints = scene.hands["right"].joints(scene.hand_states(at_s)["right"])
        seen = {marker.color: (marker.x_px, marker.y_px) for marker in frame.markers}
        assert set(seen) >= set(config.hand["right"].markers.values())
        for landmark, color in config.hand["right"].markers.items():
            place = landmark_point(model, landmark, *joints)
            expected = scene.cameras[frame.camera].project(place)[0]
            assert np.abs(np.subtract(seen[color], expected)).max() < 10.0
