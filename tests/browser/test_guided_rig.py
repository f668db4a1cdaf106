"""The guided steps of a whole rig in a real browser, practised from Start to Save: the simulator
carries a board before its cameras, then moves its painted tracker, and all services of the rig run.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rhot.files.calibration import load_cameras, load_objects
from rhot.geometry.transforms import inverse, vector_from_rotation
from testing.calibration_page import (
    PRACTISED,
    WAIT,
    begin,
    calibration_tab,
    choose,
    press,
    result_of,
    simulated_rig,
    wait_for_change,
    wait_for_pictures,
    wait_for_services,
)

pytestmark = pytest.mark.browser
CAMERAS = ["left", "right"]
SERVICES = (
    "simulator",
    *(f"pi_tracker --camera {camera}" for camera in CAMERAS),
    "fusion",
    "solver",
    "object_tracker",
    "calibrator",
)


@pytest.fixture
def page_url(page_of: Callable[..., str], router: str, tmp_path: Path) -> str:
    """The page of a simulated rig that runs as a whole, once all are ready."""
    url = page_of(simulated_rig(tmp_path), *SERVICES)
    wait_for_services(router, [one for one in SERVICES if " " not in one])
    wait_for_pictures(router, CAMERAS)
    return url


def test_the_places_of_the_cameras_are_practised(
    chromium: Any, page_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "calibration" / "rig.json"
    before, true = file.read_bytes(), load_cameras(file.parent, CAMERAS)["right"]
    errors: list[str] = []
    page = calibration_tab(chromium, page_url, errors)
    choose(page, "step", "Places of the cameras")
    page.get_by_text("a board with squares of 25 mm is carried before all cameras").wait_for(**WAIT)
    begin(page, PRACTISED)
    page.get_by_text(re.compile(rf"\d/{PRACTISED} positions")).first.wait_for(**WAIT)
    assert "✓ Good" in result_of(page, "error across the cameras, left out")
    assert file.read_bytes() == before
    press(page, "Save")
    wait_for_change(page, file, before)
    was, is_ = true.T_rig_from_camera, load_cameras(file.parent, CAMERAS)["right"].T_rig_from_camera
    assert np.linalg.norm(is_[:3, 3]) == pytest.approx(np.linalg.norm(was[:3, 3]), rel=0.01)
    turn_rad = vector_from_rotation(is_[:3, :3].T @ was[:3, :3])
    assert np.rad2deg(np.linalg.norm(turn_rad)) < 0.3
    assert errors == []
    page.close()


def test_the_objects_are_practised(chromium: Any, page_url: str, tmp_path: Path) -> None:
    file = tmp_path / "calibration" / "objects.json"
    before = file.read_bytes()
    true = np.array(load_objects(file.parent).T_rig_from_lighthouse)
    errors: list[str] = []
    page = calibration_tab(chromium, page_url, errors)
    choose(page, "step", "Objects")
    page.get_by_text("Press Start: the painted tracker is moved and turned.").wait_for(**WAIT)
    press(page, "Start")
    page.get_by_text(re.compile(r"\d+ pictures")).first.wait_for(**WAIT)
    assert "✓ Good" in result_of(page, "error of seconds that were left out")
    assert file.read_bytes() == before
    press(page, "Save")
    wait_for_change(page, file, before)
    made = np.array(load_objects(file.parent).T_rig_from_lighthouse)
    # Where it counts: before the cameras, as seen from the lighthouse.
    middle = np.array([0.04, 0.0, 0.5, 1.0])
    assert np.linalg.norm((made @ inverse(true) @ middle - middle)[:3]) < 5e-3
    assert errors == []
    page.close()
