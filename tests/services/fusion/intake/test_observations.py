"""From MarkerFrames to observations."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import ObjectTable
from rhot.messages import Marker, MarkerFrame
from services.fusion.intake.observations import (
    CLOCK_SIGMA_MAX_S,
    SIGMA_MAX_PX,
    SIGMA_MIN_PX,
    FrameRejection,
    ObservationBuilder,
    View,
)
from testing.synthetic_points import START_NS, SyntheticRig

SETUP = SyntheticRig()


def marker(color="blue", x=320.0, y=240.0, sigma=0.1, quality=1.0) -> Marker:
    return Marker(color=color, x_px=x, y_px=y, area_px=50.0, sigma_px=sigma, quality=quality)


def frame(*markers, **fields) -> MarkerFrame:
    values = {
        "camera": "left",
        "seq": 3,
        "stamp_ns": START_NS,
        "row_time_ns": 30_000.0,
        "clock_offset_ns": 0,
        "clock_sigma_ns": 1000,
        "size_px": (640, 480),
        "markers": list(markers),
    }
    return MarkerFrame(**{**values, **fields})


@pytest.fixture
def builder() -> ObservationBuilder:
    return ObservationBuilder(SETUP.config(), SETUP.rig())


def test_each_marker_has_its_own_instant(builder):
    view = builder.build(
        frame(marker("blue", y=0.0), marker("violet", y=479.0), clock_offset_ns=5_000_000)
    )
    assert isinstance(view, View)
    assert [builder.landmarks[index].name for index in view.landmarks] == ["wrist", "index_tip"]
    absolute_ns = (view.instant_ns - START_NS + 5_000_000) + 1e9 * view.delay_s
    np.testing.assert_allclose(absolute_ns, [479.0 * 30_000.0, 0.0], atol=1.0)


def test_rays_are_undistorted_and_sigma_is_per_ray(builder):
    view = builder.build(frame(marker(x=100.0, y=50.0, sigma=0.2)))
    camera = SETUP.rig()["left"]
    np.testing.assert_allclose(camera.pixels_from_rays(view.rays)[0], [100.0, 50.0], atol=1e-6)
    assert view.sigmas[0] == pytest.approx(0.2 / camera.focal_px[0], rel=0.05)


def test_of_two_blobs_of_one_colour_the_better_counts(builder):
    view = builder.build(
        frame(
            marker(x=10.0, quality=0.2), marker(x=400.0, quality=0.9), marker(x=20.0, quality=0.5)
        )
    )
    assert view.rays[0, 0] > 0.0
    assert view.ignored == 2


def test_absurd_markers_are_left_out_and_absurd_sigmas_limited(builder):
    absurd = [
        marker(x=1e300),
        marker("cyan", y=-5.0),
        marker("green", x=float("nan")),
        marker("beige"),
        marker("lime", sigma=float("inf")),
    ]
    view = builder.build(frame(*absurd))
    assert len(view.landmarks) == 0
    assert view.ignored == 5
    sigmas = (
        builder.build(frame(marker(sigma=0.0), marker("cyan", sigma=1e9))).sigmas
        * SETUP.rig()["left"].focal_px[0]
    )
    np.testing.assert_allclose(sigmas, [SIGMA_MIN_PX, SIGMA_MAX_PX], rtol=0.02)


def test_the_middle_of_a_marker_that_the_edge_cuts_may_be_outside_by_its_radius(builder):
    def seen(*places):
        colors = ("blue", "cyan", "lime")
        return builder.build(
            frame(*(marker(one, *at) for one, at in zip(colors, places, strict=True)))
        )

    # An area of 50 has a radius of 4 px.
    view = seen((-3.0, 240.0), (320.0, 482.0), (20.0, 20.0))
    assert len(view.landmarks) == 3
    assert view.cut.tolist() == [True, True, False]
    assert seen((-5.0, 240.0), (644.0, 240.0), (320.0, 484.0)).ignored == 3
    # Nobody's marker is as large as the picture.
    huge = msgspec.structs.replace(marker(x=-200.0), area_px=1e300)
    assert builder.build(frame(huge)).ignored == 1


def test_frames_of_no_use_say_why(builder):
    assert builder.build(frame(camera="door")) is FrameRejection.UNKNOWN_CAMERA
    assert builder.build(frame(size_px=(1280, 960))) is FrameRejection.WRONG_SIZE
    assert (
        builder.build(frame(stamp_ns=0, clock_offset_ns=2**61)) is FrameRejection.IMPLAUSIBLE_STAMP
    )
    assert (
        builder.build(frame(stamp_ns=2**63 - 1, clock_offset_ns=-(2**62)))
        is FrameRejection.IMPLAUSIBLE_STAMP
    )


def test_an_unknown_clock_is_as_bad_as_can_be(builder):
    assert builder.build(frame(clock_sigma_ns=-1)).clock_sigma_s == CLOCK_SIGMA_MAX_S
    assert builder.build(frame(clock_sigma_ns=2**62)).clock_sigma_s == CLOCK_SIGMA_MAX_S
    assert builder.build(frame(clock_sigma_ns=2000)).clock_sigma_s == pytest.approx(2e-6)


def test_two_hands_have_their_own_landmarks():
    config = SETUP.config()
    left = {"index_tip": "orange"}
    hands = {**config.hand, "left": type(config.hand["right"])(markers=left)}
    builder = ObservationBuilder(msgspec.structs.replace(config, hand=hands), SETUP.rig())
    view = builder.build(frame(marker("orange", x=50.0), marker("blue", x=500.0)))
    assert [(builder.landmarks[n].hand, builder.landmarks[n].name) for n in view.landmarks] == [
        ("left", "index_tip"),
        ("right", "index_tip"),
    ]


def test_paint_on_an_objects_tracker_is_no_marker_of_a_hand_and_no_refusal():
    cup = ObjectTable(name="cup", serial="LHR-1", marker="orange")
    config = msgspec.structs.replace(SETUP.config(), object=[cup])
    view = ObservationBuilder(config, SETUP.rig()).build(
        frame(marker("blue"), marker("orange"), marker("pink"))
    )
    assert isinstance(view, View)
    assert len(view.landmarks) == 1
    assert view.ignored == 1
