"""The whole of fusion on a synthetic hand: accuracy, honesty, faults."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from enum import Enum

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.config import Fusion
from rhot.errors import CalibrationError
from rhot.messages import Marker, MarkerFrame
from rhot.transforms import apply, rotation_from_vector, transform
from services.fusion.step import FusionStep
from services.fusion.synthetic import START_NS, Path, Setup, frames, point_hands

MOVING, SETUP = Path(), Setup()


def replace(frame, **fields):
    return msgspec.structs.replace(frame, **fields)


# Issue 4's bounds are 7, 2.5 and 2 mm; these are nearer to what was measured (2.0, .8, .7), so that a loss shows.
@pytest.mark.parametrize(("lag", "limit_mm"), [(0, 2.6), (1, 1.1), (2, 0.95)])
def test_moving_hand_is_accurate_and_sigma_honest(run, lag, limit_mm):
    _, found = run(SETUP, MOVING, Fusion(lag_frames=lag), seconds=10.0)
    assert found.rms_mm < limit_mm
    assert 0.8 < found.nees < 1.2
    assert found.measured.mean() > 0.98


@pytest.mark.parametrize(("distance_m", "limit_mm"), [(0.5, 0.6), (1.0, 2.0)])
def test_still_hand_is_accurate_and_sigma_honest(run, distance_m, limit_mm):
    _, found = run(SETUP, Path(distance_m=distance_m, speed_m_s=0.0), seconds=10.0)
    assert found.depth_rms_mm < limit_mm
    assert 0.7 < found.nees < 1.2


@pytest.mark.parametrize("cameras", [3, 4])
def test_more_cameras_are_better(run, cameras):
    _, two = run(SETUP, MOVING, Fusion(lag_frames=1))
    _, more = run(Setup(cameras=cameras, phase_s=1.0 / (30.0 * cameras)), MOVING, Fusion(lag_frames=1))
    assert more.rms_mm < 0.7 * two.rms_mm
    assert 0.75 < more.nees < 1.25


def test_paired_methods_rank_as_they_should(run):
    rms = {
        pairing: run(SETUP, MOVING, Fusion(method="triangulate", pairing=pairing, filter="none"))[1].rms_mm
        for pairing in ("hermite", "linear", "nearest")
    }
    assert rms["hermite"] < 4.0 < rms["linear"] < 10.0 < rms["nearest"]


def test_disparity_law_is_off_by_its_fit_only(run):
    _, found = run(SETUP, Path(speed_m_s=0.0, distance_m=0.6), Fusion(method="disparity", filter="none"))
    # 4543.3 * 65.9 ** -1.035 is 59.5 cm for 60.
    assert 2.0 < found.rms_mm < 8.0
    law = msgspec.convert({"method": "disparity", "filter": "none", "disparity": {"law": "geometry"}}, Fusion)
    assert run(SETUP, Path(speed_m_s=0.0, distance_m=0.6), law)[1].rms_mm < 1.5


def test_one_message_per_reference_frame_with_rising_stamps(fuse):
    step, told = fuse(SETUP, frames(SETUP, MOVING, 5.0), Fusion(lag_frames=1))
    stamps = [message.stamp_ns for message in told]
    assert stamps == sorted(set(stamps))
    assert [message.seq for message in told] == list(range(len(told)))
    assert len(told) == pytest.approx(150, abs=3)
    assert step.flush() == []


@pytest.mark.parametrize("method", ["kalman", "triangulate", "disparity"])
def test_the_frame_of_the_rig_does_not_matter(method):
    """Test: the same frames with [rig.world] turning the rig frame z up. Expected: the same points, turned."""
    T = transform(rotation_from_vector([1.2, -0.4, 0.7]), [0.3, -0.2, 1.1])
    cameras = SETUP.rig()
    turned = {name: dataclasses.replace(camera, T_rig_from_camera=T @ camera.T_rig_from_camera) for name, camera in cameras.items()}
    config = SETUP.config(Fusion(method=method))
    plain, other = (FusionStep(config, each, point_hands()) for each in (cameras, turned))
    for frame in frames(SETUP, MOVING, 1.0):
        for a, b in zip(plain.step(frame), other.step(frame), strict=True):
            assert [p.name for p in a.points] == [p.name for p in b.points]
            for here, there in zip(a.points, b.points, strict=True):
                np.testing.assert_allclose(apply(T, here.position_m), there.position_m, atol=3e-6)


def test_same_input_same_bytes(fuse):
    given_frames = frames(SETUP, MOVING, 2.0)
    first, second = (msgspec.json.encode(fuse(SETUP, given_frames, Fusion(lag_frames=2))[1]) for _ in range(2))
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


def between(begin_s: float, end_s: float, camera: str | None, change: Callable[[MarkerFrame], MarkerFrame | None]) -> Edit:
    def edit(given_frames: list[MarkerFrame]) -> list[MarkerFrame]:
        found = []
        for frame in given_frames:
            hit = begin_s <= seconds_of(frame) < end_s and camera in (None, frame.camera)
            changed = change(frame) if hit else frame
            found += [changed] if changed is not None else []
        return found

    return edit


def swap_names(frame: MarkerFrame) -> MarkerFrame:
    names = {"blue": "cyan", "cyan": "blue"}
    return replace(frame, markers=[replace(m, color=names.get(m.color, m.color)) for m in frame.markers])


def lost(frame: MarkerFrame) -> None:
    """The frame never arrives."""


def mirror(frame: MarkerFrame) -> MarkerFrame:
    return replace(frame, markers=[replace(m, x_px=639.0 - m.x_px) for m in frame.markers])


def shuffled(given_frames: list[MarkerFrame]) -> list[MarkerFrame]:
    """Each frame comes at random up to three places late, and one in five comes twice."""
    random = np.random.default_rng(0)
    order = np.argsort(np.arange(len(given_frames)) + random.uniform(0.0, 3.0, len(given_frames)))
    return [given_frames[k] for k in order for _ in range(2 if random.random() < 0.2 else 1)]


def far_away(frame: MarkerFrame) -> MarkerFrame:
    return replace(frame, stamp_ns=4_000_000_000_000_000_000)


class Fault(Enum):
    """What can happen to a rig between 2 s and 4 s."""

    ONE_CAMERA_STOPS = "the right camera stops and returns"
    REFERENCE_STOPS = "the left camera, which sets the pace, stops and returns"
    CLOCK_JUMPS_AHEAD = "the right camera's clock jumps 1 s ahead and back"
    CLOCK_JUMPS_BACK = "the left camera's clock jumps 1 s back and ahead"
    ANOTHER_YEAR = "the left camera's stamps are of another century"
    NETWORK_PAUSE = "nothing arrives"
    NAMES_SWAP_FOR_A_FRAME = "two markers swap names in one frame"
    MIRRORED = "the right view is mirrored by a wrong setting"
    OTHER_SIZE = "the right camera's pictures are not of the calibrated size"
    UNKNOWN_CAMERA = "frames come from a camera that is not in the rig"
    OUT_OF_ORDER_AND_TWICE = "frames come up to three places late, one in five twice, all the time"


EDITS: dict[Fault, Edit] = {
    Fault.ONE_CAMERA_STOPS: between(2.0, 4.0, "right", lost),
    Fault.REFERENCE_STOPS: between(2.0, 4.0, "left", lost),
    Fault.CLOCK_JUMPS_AHEAD: between(2.0, 4.0, "right", lambda frame: replace(frame, stamp_ns=frame.stamp_ns + 10**9)),
    Fault.CLOCK_JUMPS_BACK: between(2.0, 4.0, "left", lambda frame: replace(frame, stamp_ns=frame.stamp_ns - 10**9)),
    Fault.ANOTHER_YEAR: between(2.0, 4.0, "left", far_away),
    Fault.NETWORK_PAUSE: between(2.0, 4.0, None, lost),
    Fault.NAMES_SWAP_FOR_A_FRAME: between(2.0, 2.034, "left", swap_names),
    Fault.MIRRORED: between(2.0, 4.0, "right", mirror),
    Fault.OTHER_SIZE: between(2.0, 4.0, "right", lambda frame: replace(frame, size_px=(1280, 960))),
    Fault.UNKNOWN_CAMERA: between(2.0, 4.0, "right", lambda frame: replace(frame, camera="door")),
    Fault.OUT_OF_ORDER_AND_TWICE: shuffled,
}

BLIND = {
    Fault.ONE_CAMERA_STOPS,
    Fault.REFERENCE_STOPS,
    Fault.CLOCK_JUMPS_AHEAD,
    Fault.CLOCK_JUMPS_BACK,
    Fault.ANOTHER_YEAR,
    Fault.NETWORK_PAUSE,
    Fault.OTHER_SIZE,
    Fault.UNKNOWN_CAMERA,
}


@pytest.mark.parametrize("fault", Fault, ids=lambda fault: fault.name.lower())
def test_fault(fault, fuse, judge):
    """Test: the fault lasts from 2 s to 4 s. Expected: no wrong point during it, and all points right half a second after."""
    setup = Setup(clock_error_s=0.0, clock_sigma_s=1e-4)
    _, told = fuse(setup, EDITS[fault](frames(setup, MOVING, 6.0)))
    found = judge(told, MOVING)
    chi = np.sqrt(np.mean((found.errors_m / found.sigmas_m) ** 2, axis=1))
    after = found.instants_s > 4.5
    # A late frame of the reference camera has no instant of its own any more, and the newest frames are missing more often.
    disorder = fault is Fault.OUT_OF_ORDER_AND_TWICE
    assert after.sum() > (0.8 if disorder else 0.95) * 6 * 44
    assert 1e3 * np.sqrt(np.mean(np.sum(found.errors_m[after] ** 2, axis=1))) < (5.0 if disorder else 3.0)
    if fault is not Fault.MIRRORED:
        assert np.mean(chi > 5.0) < 0.005
    during = (found.instants_s > 2.3) & (found.instants_s < 4.0)
    if fault in BLIND:
        assert not during.any()
    elif fault is Fault.MIRRORED:
        assert found.measured[during].sum() < 0.1 * 6 * 51
    else:
        assert found.measured[during].mean() > 0.95


def test_a_marker_seen_by_one_camera_is_predicted_with_growing_sigma_then_dropped(fuse, judge):
    setup = Setup(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)
    hide = between(2.0, 9.0, "right", lambda frame: replace(frame, markers=[m for m in frame.markers if m.color != "blue"]))
    _, told = fuse(setup, hide(frames(setup, MOVING, 3.0)))
    index = [
        (seen.stamp_ns, point)
        for seen in told
        for point in seen.points
        if point.name == "index_tip" and seen.stamp_ns > START_NS + 2 * 10**9
    ]
    predicted = [point for _, point in index if point.source == "predicted"]
    assert 2 <= len(predicted) <= 5
    depths = [point.sigma_m[2] for point in predicted]
    assert depths == sorted(depths)
    assert all(point.cameras == ["left"] for point in predicted)
    assert index[-1][0] < START_NS + 2.25e9
    assert len(told[-1].points) == 5


number = st.one_of(st.floats(-10, 700), st.floats(allow_nan=True, allow_infinity=True))
marker = st.builds(
    lambda color, x, y, sigma: Marker(color=color, x_px=x, y_px=y, area_px=9.0, sigma_px=abs(sigma), quality=1.0),
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
