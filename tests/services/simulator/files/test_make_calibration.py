"""The simulated rig's calibration: it can be loaded, is near the nominal rig, and its colours tell
paints apart.
"""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import load_cameras, load_colors, load_exposure, load_lens, load_objects
from rhot.files.rig_tables import CameraTable
from rhot.geometry.transforms import angle_between
from services.simulator.files import make_calibration
from services.simulator.files.fit_colors import fit_ranges, in_range, sample_pixels
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import load_scene


def test_cameras_are_like_the_papers_and_each_its_own(config):
    cameras = load_cameras(config.calibration_dir, ["left", "right"])
    left, right = cameras["left"], cameras["right"]
    for camera in cameras.values():
        assert camera.focal_px[0] == pytest.approx(527.3, rel=0.01)
        assert -0.07 < camera.distortion[0] < -0.04
        load_exposure(config.calibration_dir, camera.name)
    assert not np.array_equal(left.distortion, right.distortion)
    np.testing.assert_array_equal(left.T_rig_from_camera, np.eye(4))
    np.testing.assert_allclose(right.centre_rig, (0.075, 0.0, 0.0), atol=2e-3)
    assert (
        0.0
        < np.rad2deg(angle_between(left.T_rig_from_camera[:3, :3], right.T_rig_from_camera[:3, :3]))
        < 1.0
    )
    assert "cup" in load_objects(config.calibration_dir).objects


def test_the_committed_files_are_what_the_tool_makes(config):
    lens = load_lens(config.calibration_dir, "right")
    assert make_calibration.lens(config.camera[1], lens.date) == lens


def test_any_number_of_cameras_of_any_size(config, tmp_path, monkeypatch):
    cameras = [CameraTable(name=f"pi{k}", source="simulator", size_px=(320, 240)) for k in range(3)]
    own = msgspec.structs.replace(config, camera=cameras, folder=str(tmp_path))
    # A few frames of one scene are enough to see that ranges come out.
    monkeypatch.setattr(make_calibration, "_SCENES", ("piano",))
    monkeypatch.setattr(make_calibration, "_FRAMES", (3, 20, 37, 54))
    paths = make_calibration.write_all(own, "2025-01-01")
    assert len(paths) == 3 * 3 + 2
    scene = load_scene(own, "piano")
    assert [round(float(c.centre_rig[0]), 2) for c in scene.cameras.values()] == [
        0.0,
        0.07,
        0.15,
    ] or len(scene.cameras) == 3
    assert Renderer(scene, "pi2").picture(3).shape == (360, 320)
    assert load_colors(own.calibration_dir, "pi1").date == "2025-01-01"


@pytest.mark.parametrize("camera", ["left", "right"])
@pytest.mark.parametrize("name", ["pinch", "grab"])
def test_colour_ranges_fit_scenes_they_were_not_fitted_to(config, camera, name):
    colors = load_colors(config.calibration_dir, camera).colors
    renderer = Renderer(load_scene(config, name, seed=5), camera)
    painted, other = sample_pixels(renderer, (10, 45, 80))
    for (hand, landmark), surface in renderer.shapes.paint_surfaces.items():
        color = config.hand[hand].markers[landmark]
        assert in_range(colors[color], painted[surface]).mean() > 0.95, color
        assert in_range(colors[color], other).mean() < 1e-4, color
        for landmark_of_another, another in renderer.shapes.paint_surfaces.items():
            if landmark_of_another != (hand, landmark):
                assert in_range(colors[color], painted[another]).mean() < 0.01, (
                    color,
                    landmark_of_another,
                )


def test_hues_that_wrap_through_red():
    rng = np.random.default_rng(1)
    hue = rng.integers(-6, 7, 500) % 180
    red = np.stack([hue, np.full(500, 200), np.full(500, 150)], axis=1)
    skin = np.stack([np.full(100, 14), np.full(100, 90), np.full(100, 180)], axis=1)
    bounds = fit_ranges({"red": red}, skin, "", "test").colors["red"]
    assert bounds.hsv_low[0] > bounds.hsv_high[0]
    assert in_range(bounds, red).mean() > 0.95
    assert not in_range(bounds, skin).any()


def test_a_colour_nobody_sees_is_an_error():
    nothing = np.empty((0, 3), np.int64)
    with pytest.raises(CalibrationError, match="blue"):
        fit_ranges({"blue": nothing}, nothing, "", "test")
