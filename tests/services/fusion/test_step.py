"""The whole of fusion on a synthetic hand: accuracy, consistency of sigma, faults."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.rig_tables import Fusion
from rhot.geometry.transforms import apply, rotation_from_vector, transform
from rhot.messages import Marker, MarkerFrame
from services.fusion.step import FusionStep
from testing.synthetic_points import (
    START_NS,
    MovingHand,
    RestingHand,
    SyntheticRig,
    frames,
    point_hands,
)

MOVING, SETUP = MovingHand(), SyntheticRig()


def replace(frame, **fields):
    return msgspec.structs.replace(frame, **fields)


# Near to what was measured (1.6, .7, .6), so that a loss shows.
@pytest.mark.parametrize(("lag", "limit_mm"), [(0, 2.2), (1, 0.95), (2, 0.8)])
def test_moving_hand_is_accurate_and_its_sigma_consistent(run, lag, limit_mm):
    _, found = run(SETUP, MOVING, Fusion(lag_frames=lag), seconds=10.0)
    assert found.rms_mm < limit_mm
    assert 0.7 < found.nees < 1.2
    assert found.measured.mean() > 0.98


# Issue 4's bounds are .6 and 2 mm; measured .27 and .65.
@pytest.mark.parametrize(("distance_m", "limit_mm"), [(0.5, 0.35), (1.0, 0.9)])
def test_still_hand_is_accurate_and_its_sigma_consistent(run, distance_m, limit_mm):
    _, found = run(SETUP, RestingHand(distance_m=distance_m), seconds=10.0)
    assert found.depth_rms_mm < limit_mm
    assert 0.7 < found.nees < 1.2


def test_a_hand_without_any_motion_is_known_better_than_sigma_says(run):
    """Test: no motion at all.

    Expected: a smaller error than of a hand that sways, within a sigma that allows for sway.
    """
    _, plaster = run(SETUP, MovingHand(distance_m=1.0, speed_m_s=0.0), seconds=10.0)
    _, alive = run(SETUP, RestingHand(), seconds=10.0)
    assert plaster.depth_rms_mm < alive.depth_rms_mm
    assert 0.5 < plaster.nees < 1.0


@pytest.mark.parametrize("cameras", [3, 4])
def test_more_cameras_are_better(run, cameras):
    _, two = run(SETUP, MOVING, Fusion(lag_frames=1))
    _, more = run(
        SyntheticRig(cameras=cameras, phase_s=1.0 / (30.0 * cameras)), MOVING, Fusion(lag_frames=1)
    )
    assert more.rms_mm < 0.7 * two.rms_mm
    assert 0.75 < more.nees < 1.5


def test_paired_methods_rank_as_they_should(run):
    rms = {
        pairing: run(SETUP, MOVING, Fusion(method="triangulate", pairing=pairing, filter="none"))[
            1
        ].rms_mm
        for pairing in ("hermite", "linear", "nearest")
    }
    assert rms["hermite"] < 4.0 < rms["linear"] < 10.0 < rms["nearest"]


def test_disparity_law_is_off_by_its_fit_only(run):
    _, found = run(
        SETUP, MovingHand(speed_m_s=0.0, distance_m=0.6), Fusion(method="disparity", filter="none")
    )
    # 4543.3 * 65.9 ** -1.035 is 59.5 cm for 60.
    assert 2.0 < found.rms_mm < 8.0
    law = msgspec.convert(
        {"method": "disparity", "filter": "none", "disparity": {"law": "geometry"}}, Fusion
    )
    assert run(SETUP, MovingHand(speed_m_s=0.0, distance_m=0.6), law)[1].rms_mm < 1.5


def test_one_message_per_reference_frame_with_rising_stamps(fuse):
    step, messages = fuse(SETUP, frames(SETUP, MOVING, 5.0), Fusion(lag_frames=1))
    stamps = [message.stamp_ns for message in messages]
    assert stamps == sorted(set(stamps))
    assert [message.seq for message in messages] == list(range(len(messages)))
    assert len(messages) == pytest.approx(150, abs=3)
    assert step.flush() == []


@pytest.mark.parametrize("method", ["kalman", "triangulate", "disparity"])
def test_the_frame_of_the_rig_does_not_matter(method):
    """Test: the same frames with [rig.world] turning the rig frame z up.

    Expected: the same points, turned.
    """
    T = transform(rotation_from_vector([1.2, -0.4, 0.7]), [0.3, -0.2, 1.1])
    cameras = SETUP.rig()
    turned = {
        name: dataclasses.replace(camera, T_rig_from_camera=T @ camera.T_rig_from_camera)
        for name, camera in cameras.items()
    }
    config = SETUP.config(Fusion(method=method))
    plain, other = (FusionStep(config, each, point_hands()) for each in (cameras, turned))
    for frame in frames(SETUP, MOVING, 1.0):
        for a, b in zip(plain.step(frame), other.step(frame), strict=True):
            assert [p.name for p in a.points] == [p.name for p in b.points]
            for here, there in zip(a.points, b.points, strict=True):
                np.testing.assert_allclose(apply(T, here.position_m), there.position_m, atol=3e-6)


def test_same_input_same_bytes(fuse):
    given_frames = frames(SETUP, MOVING, 2.0)
    first, second = (
        msgspec.json.encode(fuse(SETUP, given_frames, Fusion(lag_frames=2))[1]) for _ in range(2)
    )
    assert first == second


def test_needs_two_cameras_and_a_hand():
    cameras = SETUP.rig()
    with pytest.raises(CalibrationError, match="two calibrated cameras"):
        FusionStep(SETUP.config(), {"left": cameras["left"]}, point_hands())
    with pytest.raises(CalibrationError, match="right hand"):
        FusionStep(SETUP.config(), cameras, {})


Edit = Callable[[list[MarkerFrame]], list[MarkerFrame]]


def seconds_of(frame: MarkerFrame) -> float:
    return (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9


def between(
    begin_s: float,
    end_s: float,
    camera: str | None,
    change: Callable[[MarkerFrame], MarkerFrame | None],
) -> Edit:
    def edit(given_frames: list[MarkerFrame]) -> list[MarkerFrame]:
        found = []
        for frame in given_frames:
            hit = begin_s <= seconds_of(frame) < end_s and camera in (None, frame.camera)
            changed = change(frame) if hit else frame
            found += [changed] if changed is not None else []
        return found

    return edit


def test_a_marker_seen_by_one_camera_is_known_across_its_ray(fuse):
    setup = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)
    hide = between(
        2.0,
        9.0,
        "right",
        lambda frame: replace(frame, markers=[m for m in frame.markers if m.color != "blue"]),
    )
    _, messages = fuse(setup, hide(frames(setup, MOVING, 3.0)))
    index = [
        (seen.stamp_ns, point)
        for seen in messages
        for point in seen.points
        if point.name == "index_tip" and seen.stamp_ns > START_NS + 2 * 10**9
    ]
    predicted = [point for _, point in index if point.source == "predicted"]
    assert len(predicted) >= 15
    assert all(point.cameras == ["left"] for point in predicted)
    first, last = (np.linalg.eigvalsh(_covariance(predicted[k])) for k in (0, -1))
    assert last[1] < 5e-3**2 < last[2]
    assert last[2] > 10.0 * first[2]


def test_a_marker_that_no_camera_sees_is_dropped(fuse):
    setup = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)
    given = frames(setup, MOVING, 3.0)
    for camera in setup.names:
        given = between(
            2.0,
            9.0,
            camera,
            lambda frame: replace(frame, markers=[m for m in frame.markers if m.color != "blue"]),
        )(given)
    _, messages = fuse(setup, given)
    last_ns = max(
        seen.stamp_ns
        for seen in messages
        if any(point.name == "index_tip" for point in seen.points)
    )
    assert START_NS + 2e9 < last_ns < START_NS + 2.25e9
    assert len(messages[-1].points) == 5


def _covariance(point):
    """(3, 3) of a HandPoint."""
    xx, xy, xz, yy, yz, zz = point.covariance_m2
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


number = st.one_of(st.floats(-10, 700), st.floats(allow_nan=True, allow_infinity=True))
marker = st.builds(
    lambda color, x, y, sigma: Marker(
        color=color, x_px=x, y_px=y, area_px=9.0, sigma_px=abs(sigma), quality=1.0
    ),
    st.sampled_from(["blue", "cyan", "violet", "unheard"]),
    number,
    number,
    number,
)
anything = st.builds(
    lambda camera, stamp, row, offset, sigma, markers: MarkerFrame(
        camera=camera,
        seq=1,
        stamp_ns=stamp,
        row_time_ns=row,
        clock_offset_ns=offset,
        clock_sigma_ns=sigma,
        size_px=(640, 480),
        markers=markers,
    ),
    st.sampled_from(["left", "right", "door"]),
    st.one_of(st.integers(0, 10**9), st.integers(0, 2**63 - 1)),
    st.floats(0.0, 1e8),
    st.one_of(st.just(0), st.integers(-(2**62), 2**62)),
    st.integers(-1, 2**62),
    st.lists(marker, max_size=6),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(anything, max_size=30))
def test_whatever_comes_nothing_breaks(given_frames):
    step = FusionStep(SETUP.config(), SETUP.rig(), point_hands())
    for frame in given_frames:
        for message in step.step(frame):
            # A message that decodes is finite and within the bounds of its fields.
            msgspec.json.decode(msgspec.json.encode(message), type=type(message))
    step.flush()


def test_what_points_do_not_wait_for_is_the_same_whoever_does_it():
    """Live it is done once the points are out, offline with the next frame."""
    given_frames = frames(SETUP, MOVING, 2.0)
    one, two = (FusionStep(SETUP.config(), SETUP.rig(), point_hands()) for _ in range(2))
    for frame in given_frames:
        told = two.step(frame)
        two.settle()
        assert one.step(frame) == told
    assert two.clocks.updates > 0


def test_a_loop_that_is_behind_learns_less_and_tells_as_much():
    """The clocks from a third of the frames; they come out the same all the same."""
    given_frames = frames(SETUP, MOVING, 4.0)
    ready, behind = (FusionStep(SETUP.config(), SETUP.rig(), point_hands()) for _ in range(2))
    told: dict[FusionStep, int] = {ready: 0, behind: 0}
    for frame in given_frames:
        for step in told:
            told[step] += len(step.step(frame))
            step.settle(behind=step is behind)
    assert ready.unlearned == 0
    assert behind.unlearned == pytest.approx(2 / 3 * len(given_frames), abs=2)
    assert told[behind] == told[ready] > 100
    assert 0 < behind.clocks.updates < ready.clocks.updates
    for camera, late_s in ready.clocks.late_s.items():
        assert behind.clocks.late_s[camera] == pytest.approx(late_s, abs=5e-4)


def test_cameras_may_see_nothing_for_as_long_as_they_like():
    """Also while clocks that are off are searched for, which rests on seconds of markers."""
    setup = SyntheticRig()
    step = FusionStep(setup.config(), setup.rig(), point_hands())
    told = [
        points
        for frame in frames(setup, MovingHand(), 8.0)
        for points in step.step(msgspec.structs.replace(frame, markers=[]))
    ]
    step.settle()
    assert len(told) > 200
    assert not any(points.points for points in told)
    assert step.alignment.searches > 1
