"""The families' truth: markers are where it is projected, and the halves share nothing."""

from __future__ import annotations

import numpy as np
import pytest

from testing.families.case import HALVES, Case
from testing.families.catalog import FAMILIES, cases
from testing.families.point_catalog import point_cases
from testing.families.points import point_case
from testing.families.spline_bound import spline_bound
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig

pytestmark = pytest.mark.usefixtures("rhot_data")


def truth_errors_px(case: Case, only: str = "") -> np.ndarray:
    """Every marker's distance from its landmark, projected at the marker's own instant; px.

    only: of one camera.
    """
    found = []
    hand = case.config.hand[case.hand]
    landmark_of = {color: case.landmarks.index(name) for name, color in hand.markers.items()}
    for frame in case.frames:
        camera, markers = case.cameras[frame.camera], frame.markers
        begin_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        begin_s -= (case.clock_errors_s or {}).get(frame.camera, 0.0)
        times_s = np.array([begin_s + m.y_px * frame.row_time_ns * 1e-9 for m in markers])
        if not markers or only not in ("", frame.camera):
            continue
        rows = [landmark_of[marker.color] for marker in markers]
        places = case.truth(times_s)[np.arange(len(markers)), rows]
        seen = np.array([(marker.x_px, marker.y_px) for marker in markers])
        found.append(np.linalg.norm(camera.project(places) - seen, axis=1))
    return np.concatenate(found)


@pytest.mark.parametrize("spec", point_cases(), ids=lambda spec: f"{spec.half}-{spec.name}")
def test_markers_are_where_the_truth_is_projected(spec):
    case = spec.build()
    sigma_px = np.mean([marker.sigma_px for frame in case.frames for marker in frame.markers])
    tilted = spec.family == "tilt"
    errors_px = truth_errors_px(case, only="left" if tilted else "")
    # Noise in two directions; a row's instant is solved to a hundredth of a row.
    assert np.sqrt(np.mean(errors_px**2)) < 1.15 * np.sqrt(2.0) * sigma_px
    if tilted:
        # A tenth of a degree is .9 px.
        assert np.mean(truth_errors_px(case, only="right")) > 0.8


def test_the_halves_share_no_case():
    names = {half: {(s.family, s.name) for s in cases(half, "points")} for half in HALVES}
    assert not names["tuning"] & names["held_out"]
    families = [{family for family, _ in names[half]} for half in HALVES]
    assert families[0] == families[1] <= set(FAMILIES)


def test_no_motion_of_the_held_out_half_is_one_of_the_tuning_half():
    instants_s = np.linspace(1.0, 5.0, 400)
    paths = {
        half: [spec.build().truth(instants_s) for spec in cases(half, "points")] for half in HALVES
    }
    for one in paths["tuning"]:
        for other in paths["held_out"]:
            assert np.nanmax(np.abs(one - other)) > 0.01


def test_gaps_are_what_cameras_do_not_see():
    spec = next(s for s in cases("held_out", "points", "gaps") if "one camera" in s.name)
    case = spec.build()
    dark = [f for f, shares in zip(case.frames, case.visible, strict=True) if not shares.any()]
    assert {frame.camera for frame in dark} == {"left"}
    assert not any(frame.markers for frame in dark)
    # From 1.6 s on for .3 s, again 2.5 s later.
    seen = case.seen(np.array([1.5, 1.75, 2.2, 4.25]))
    assert seen[[0, 2]].any()
    assert not seen[[1, 3]].any()


def test_the_spline_finds_what_moves_smoothly():
    setup = SyntheticRig(sigma_px=1e-4, clock_error_s=0.0, loss=0.0)
    case = point_case("smooth", MovingHand(speed_m_s=0.2, seed=5), setup)
    instants_s = np.linspace(1.0, 7.0, 100)
    errors_m = spline_bound(case, instants_s) - case.truth(instants_s)
    # What a cubic leaves of 2.5 Hz sampled at 30.
    assert np.linalg.norm(errors_m, axis=2).max() < 1e-3
