"""Where trackers sit on their objects, and which objects.json a simulated rig believes."""

from __future__ import annotations

import shutil

import msgspec
import numpy as np
import pytest

from rhot.files.calibration import Objects, load_objects, save
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.solids import Box, Cylinder, Sphere
from rhot.geometry.transforms import apply, inverse, rotation_from_quaternion, transform
from services.simulator.files import make_calibration
from services.simulator.scene.scene import load_scene
from services.simulator.scene.tracker_mounts import believed, below_m, simulated_place

IDENTITY = tuple(map(tuple, np.eye(4).tolist()))


@pytest.mark.parametrize(
    ("solid", "below"),
    [
        (Box((0.1, 0.2, 0.3)), 0.1),
        (Cylinder(0.05, 0.12), 0.06),
        (Sphere(0.08), 0.04),
        (None, 0.075),
    ],
)
def test_a_puck_stands_on_its_objects_low_end(solid, below):
    place = simulated_place(ObjectTable(name="it", serial="S", marker="leaf"), solid)
    assert below_m(solid) == pytest.approx(below)
    T_object_from_tracker = inverse(
        transform(rotation_from_quaternion(place.orientation_wxyz), place.offset_m)
    )
    np.testing.assert_allclose(
        apply(T_object_from_tracker, (0, 0, 0)).ravel(), (0, -below, 0), atol=1e-6
    )
    # Its top, with the bead, points away from the object.
    assert apply(T_object_from_tracker, place.marker_m).ravel()[1] < -below - 0.04


def test_the_committed_file_is_what_the_tool_makes(config):
    objects = load_objects(config.calibration_dir)
    assert make_calibration.objects(config, objects.date) == objects


def test_an_estimate_is_not_the_truth(config, tmp_path):
    """Who calibrates a simulated rig does not move its lighthouse by it."""
    truth = load_objects(config.calibration_dir)
    estimate = msgspec.structs.replace(
        truth,
        tool="rhot calibrate objects",
        T_rig_from_lighthouse=IDENTITY,
    )
    assert believed(estimate) is None
    assert believed(truth) is truth
    assert believed(None) is None
    shutil.copytree(config.calibration_dir, tmp_path / "calibration")
    own = msgspec.structs.replace(config, folder=str(tmp_path))
    before = load_scene(own, "piano")
    for change in ("estimated", "unregistered"):
        if change == "estimated":
            save(tmp_path / "calibration" / "objects.json", estimate)
        else:
            (tmp_path / "calibration" / "objects.json").unlink()
        after = load_scene(own, "piano")
        np.testing.assert_allclose(
            after.T_rig_from_lighthouse, before.T_rig_from_lighthouse, atol=1e-7
        )
        assert after.objects[0].place == before.objects[0].place


def test_a_file_of_no_tool_counts():
    assert believed(Objects(T_rig_from_lighthouse=IDENTITY)) is not None
