"""Light that changes while the tracker runs: reported with the range that fits, not followed."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.calibration import Colors
from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.light_drift import PERIOD_NS, DriftMonitor
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.step import TrackerStep

SIZE = (200, 120)
PLACES = {"green": 30.0, "blue": 66.0, "magenta": 102.0, "cyan": 138.0, "lime": 174.0}


@pytest.fixture(scope="module")
def fitted(studio, tip):
    """Ranges fitted to the studio's light."""
    tips = [tip(c, x, 60.0, width_px=13.0, length_px=14.0) for c, x in PLACES.items()]
    frame, truth = studio.frame(tips, size_px=SIZE)
    return fit(
        gather([frame], [Pointer(color, 0, *place) for color, place in truth.items()]).samples
    )


@pytest.fixture(scope="module")
def places(studio, tip):
    """Pictures of the hand at three places, without noise."""
    return [
        studio.clean(
            [tip(c, x, 55.0 + 3 * k, width_px=13.0, length_px=14.0) for c, x in PLACES.items()],
            SIZE,
        )[0]
        for k in range(3)
    ]


@pytest.fixture
def run(studio, places, fitted):
    """Twelve seconds under light of the given colour (B, G, R), or so many more of a monitor.

    The monitor at their end, and the colours that were missing in any frame.
    """

    def make(light, seconds=12, drift=None):
        step = TrackerStep("left", Colors(colors=fitted), Tracker(), SIZE, list(PLACES))
        start = 0 if drift is None else 1000
        drift, lost = drift or DriftMonitor(fitted), set()
        for number in range(start, start + seconds * 2):
            bgr = studio.bgr(places[number % 3] * np.array(light, np.float32), 5.0, number)
            frame = studio.of(bgr, number * 15)
            markers = step.step(frame).markers
            drift.update(frame, markers)
            lost |= set(PLACES) - {marker.color for marker in markers}
        return drift, lost

    return make


def test_constant_light_is_no_drift(run):
    drift, lost = run((1.0, 1.0, 1.0))
    assert lost == set()
    assert drift.drifted() == []
    assert all(abs(drift.values()[f"{color}_hue_off"]) < 0.5 for color in PLACES)


def test_less_light_is_no_drift_of_hue(run):
    drift, _ = run((0.75, 0.75, 0.75))
    assert drift.drifted() == []


def test_another_white_balance_is_told_before_markers_are_lost(run, fitted):
    drift, lost = run((1.0, 1.0, 1.12))
    drifted = {one.color: one for one in drift.drifted()}
    assert drifted
    assert not lost & set(drifted)
    for color, one in drifted.items():
        assert one.suggested != fitted[color]
        text = one.text("left")
        assert repr(color) in text
        assert "rhot calibrate colors left" in text
        low, high = one.suggested.hsv_low, one.suggested.hsv_high
        assert f"{low[0]},{low[1]},{low[2]} to {high[0]},{high[1]},{high[2]}" in text


def test_it_is_over_once_the_light_is_as_before(run):
    drift, _ = run((1.0, 1.0, 1.12))
    assert drift.drifted()
    run((1.0, 1.0, 1.0), 22, drift)
    assert drift.drifted() == []


def test_the_suggested_range_fits(run, fitted, studio, tip):
    drift, _ = run((1.0, 1.0, 1.12))
    one = drift.drifted()[0]
    clean, _ = studio.clean([tip(one.color, 60.0, 60.0, width_px=13.0, length_px=14.0)], SIZE)
    frame = studio.of(studio.bgr(clean * np.array([1.0, 1.0, 1.12], np.float32), 5.0, 99))
    after = DriftMonitor({one.color: one.suggested})
    step = TrackerStep(
        "left", Colors(colors={one.color: one.suggested}), Tracker(), SIZE, [one.color]
    )
    markers = step.step(frame).markers
    assert [marker.color for marker in markers] == [one.color]
    after.update(frame, markers)
    assert abs(after.values()[f"{one.color}_hue_off"]) < 0.5


def test_it_observes_once_a_second(studio, places, fitted):
    drift = DriftMonitor(fitted)
    frames = [studio.of(studio.bgr(places[0], 5.0, 1), seq) for seq in range(90)]
    assert sum(drift.update(frame, []) for frame in frames) == 3
    assert frames[60].stamp_ns - frames[30].stamp_ns == PERIOD_NS


@pytest.mark.parametrize(
    ("x", "y", "area"),
    [(0.0, 0.0, 1.0), (199.0, 119.0, 1e6), (1e300, -1e300, 1e300), (-5.0, 60.0, 0.0)],
)
def test_absurd_markers_do_no_harm(studio, fitted, x, y, area):
    clean, _ = studio.clean([], SIZE)
    drift = DriftMonitor(fitted)
    marker = Marker(color="green", x_px=x, y_px=y, area_px=area, sigma_px=0.1, quality=1.0)
    other = Marker(color="unknown", x_px=50.0, y_px=50.0, area_px=10.0, sigma_px=0.1, quality=1.0)
    drift.update(studio.of(studio.bgr(clean, 5.0, 1)), [marker, other])
    assert drift.values() == {}
    assert drift.drifted() == []
