"""Half a minute of figures: what is told is kept, what is not is a gap, and nothing grows."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.messages import FingerAngles, HandPose
from rhot.messages.health import Health
from services.viewer.live.model import ViewModel
from services.viewer.plots.charts import charts
from services.viewer.plots.history import History, angle_name, delay_name, rate_name

STAMP_NS = 1_700_000_000_000_000_000
BEND = angle_name("right", "index", "mcp")


@pytest.fixture
def history(config: RigConfig) -> History:
    return History(config)


def test_what_is_told_is_kept_and_what_is_not_is_a_gap(
    history: History, make_pose: Callable[..., HandPose], make_health: Callable[..., Health]
) -> None:
    model = ViewModel()
    history.take(model.view(10.0), 10.0)
    model.pose(make_pose(), 10.5, STAMP_NS + 30_000_000)
    stream = {"key": "rhot/desk/camera/left/markers", "rate_hz": 29.0}
    model.health(make_health("pi_tracker", stream=stream), 10.5)
    history.take(model.view(10.5), 10.5)
    names = [BEND, delay_name("right"), rate_name("left"), rate_name("right")]
    times_s, bend, delay, left, right = history.rows(names, 11.0)
    np.testing.assert_allclose(times_s, [-1.0, -0.5])
    np.testing.assert_allclose(bend, [np.nan, np.rad2deg(0.5)])
    np.testing.assert_allclose(delay, [np.nan, 30.0])
    np.testing.assert_allclose(left, [np.nan, 29.0])
    assert np.isnan(right).all()


def test_it_keeps_half_a_minute_in_order_and_no_more(
    history: History, make_pose: Callable[..., HandPose]
) -> None:
    model = ViewModel()
    # At 60 Hz for a minute: five times as many views as are kept of them.
    for tick in range(3600):
        now_s = 100.0 + tick / 60.0
        model.pose(make_pose(seq=tick), now_s, STAMP_NS)
        history.take(model.view(now_s), now_s)
    times_s, bend = history.rows([BEND], 160.0)
    assert len(times_s) <= 360
    assert times_s[0] == pytest.approx(-30.0, abs=1.0)
    assert times_s[-1] == pytest.approx(0.0, abs=0.1)
    assert (np.diff(times_s) > 0.08).all()
    assert not np.isnan(bend).any()
    assert len(history.rows([BEND], 300.0)[0]) == 0, "what is older is not drawn"


def test_absurd_figures_stay_in_the_picture(
    history: History, make_pose: Callable[..., HandPose], make_health: Callable[..., Health]
) -> None:
    pose = make_pose()
    angles = FingerAngles(abduction=1e300, mcp=-1e300, pip=0.0, dip=0.0)
    fingers = [msgspec.structs.replace(one, angles_rad=angles) for one in pose.fingers]
    model = ViewModel()
    model.pose(msgspec.structs.replace(pose, fingers=fingers, hand="left"), 1.0, STAMP_NS)
    model.pose(msgspec.structs.replace(pose, fingers=fingers), 1.0, STAMP_NS)
    stream = {"key": "rhot/desk/camera/left/markers", "rate_hz": 1e300}
    model.health(make_health(stream=stream), 1.0)
    model.health(make_health("x", stream={"key": "rhot/desk/camera/nobody/markers"}), 1.0)
    history.take(model.view(1.0), 1.0)
    _, bend, rate = history.rows([BEND, rate_name("left")], 1.0)
    assert bend.tolist() == [-360.0]
    assert rate.tolist() == [1000.0]


def test_every_chart_has_its_series(config: RigConfig, history: History) -> None:
    known = charts(config)
    assert list(known) == [
        "joints: right thumb",
        *(f"joints: right {digit} finger" for digit in ("index", "middle", "ring", "little")),
        "delay of the poses",
        "messages a second",
    ]
    for chart in known.values():
        assert len(history.rows([name for name, _ in chart.series], 0.0)) == len(chart.series) + 1
    assert charts(RigConfig()) == {}
