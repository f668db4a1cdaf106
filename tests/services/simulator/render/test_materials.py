"""What a scene can ask for beyond the usual: uneven paint, another skin, lamps that flicker."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from services.simulator.render.materials import flicker_gains
from services.simulator.render.renderer import Renderer
from services.simulator.scene.catalog import SCENES, Light
from services.simulator.scene.scene import build_scene

AT_S = 0.7


def scene_with(config, **more):
    return build_scene(config, dataclasses.replace(SCENES["still"], **more), "still", 1)


def painted(renderer: Renderer, landmark: str) -> np.ndarray:
    return renderer.labels(AT_S) == 1 + renderer.shapes.paint_surfaces["right", landmark]


def test_uneven_paint_ends_elsewhere_and_begins_at_the_same_tip(config):
    even, uneven = (Renderer(scene_with(config, uneven=share), "left") for share in (0.0, 0.5))
    moved = 0
    for tip in ("index_tip", "middle_tip", "ring_tip"):
        one, other = painted(even, tip), painted(uneven, tip)
        rows, columns = np.nonzero(one | other)
        far = rows < np.median(rows)
        differ = one[rows, columns] != other[rows, columns]
        # Fingers point up: what differs lies at the lower edge of the paint.
        assert not differ[far].any()
        moved += int(differ.sum())
    assert moved > 15


def test_skin_has_the_albedo_that_is_asked_for(config):
    levels = []
    for skin in ((0.15, 0.08, 0.05), (0.70, 0.48, 0.40)):
        renderer = Renderer(scene_with(config, skin=skin), "left")
        picture = cv2.cvtColor(renderer.clean(AT_S), cv2.COLOR_YUV2BGR_I420)
        levels.append(picture[renderer.labels(AT_S) == 1].mean(axis=0))
    assert np.all(levels[1] > 1.6 * levels[0])
    assert levels[0][2] > levels[0][0]


def test_flicker_runs_down_the_rows_as_the_shutter_does(config):
    steady, swinging = (
        Renderer(scene_with(config, light=Light(flicker=share), exposure_s=0.002), "left")
        for share in (0.0, 0.3)
    )
    height = steady.camera.size_px[1]
    one, other = (
        renderer.clean(AT_S)[:height].astype(float).mean(axis=1) - 16.0
        for renderer in (steady, swinging)
    )
    rows_s = AT_S + 1e-9 * steady.clock.row_time_ns * np.arange(height)
    expected = flicker_gains(Light(flicker=0.3), rows_s, 0.002) ** (1.0 / 2.2)
    assert expected.max() - expected.min() > 0.2
    assert other / one == pytest.approx(expected, abs=0.02)


def test_an_exposure_of_whole_periods_sees_no_flicker():
    times_s = np.linspace(0.0, 0.03, 50)
    assert flicker_gains(Light(flicker=0.5), times_s, 0.01) == pytest.approx(1.0)
    assert np.ptp(flicker_gains(Light(flicker=0.5), times_s, 0.004)) > 0.5
