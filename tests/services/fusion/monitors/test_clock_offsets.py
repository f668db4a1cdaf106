"""Clock errors learned from the markers' motion."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from rhot.messages import MarkerFrame
from services.fusion.intake.observations import ObservationBuilder
from services.fusion.monitors.clock_offsets import ClockOffsetEstimator
from testing.families.motions import flapping, stop_and_go
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames
from testing.wrong_markers import with_clock_error, with_correlated_errors, with_static_markers

FPS = 30.0


def estimate(
    setup: SyntheticRig,
    path: MovingHand,
    seconds: float,
    *,
    enabled: bool = True,
    edit=lambda frame: frame,
) -> ClockOffsetEstimator:
    return learn(setup, [edit(frame) for frame in frames(setup, path, seconds)], enabled=enabled)[0]


def learn(
    setup: SyntheticRig, given: list[MarkerFrame], *, enabled: bool = True
) -> tuple[ClockOffsetEstimator, np.ndarray]:
    """The estimator at the end; time (s), disagreement and its sigma (ms) after each frame."""
    cameras = setup.rig()
    builder = ObservationBuilder(setup.config(), cameras)
    estimator = ClockOffsetEstimator(
        tuple(cameras.values()), 6, np.full(len(cameras), 1.0 / FPS), enabled=enabled
    )
    told = []
    for frame in given:
        view = builder.build(frame)
        time_s = (view.instant_ns - START_NS) * 1e-9
        _, sigma_s = estimator.observe(view, time_s + view.delay_s)
        told.append((time_s, disagreement_ms(estimator), 1e3 * np.sqrt(2.0) * sigma_s))
    return estimator, np.array(told)


def disagreement_ms(estimator: ClockOffsetEstimator) -> float:
    late = estimator.late_s
    return 1e3 * (late["right"] - late["left"])


# Announced offsets are too large by +error for the left and -error for the right camera: the left
# camera's stamps come out early.
@pytest.mark.parametrize("error_s", [-0.0005, 0.0005, 0.005])
def test_learns_what_the_announced_offsets_are_wrong_by(error_s):
    estimator = estimate(
        SyntheticRig(clock_error_s=error_s, clock_sigma_s=2 * abs(error_s)), MovingHand(), 6.0
    )
    assert disagreement_ms(estimator) == pytest.approx(2e3 * error_s, abs=0.1)
    assert estimator.gated <= 0.02 * estimator.updates
    assert estimator.epipolar_px < 0.2


def test_unknown_clocks_are_found_within_two_seconds():
    estimator = estimate(
        SyntheticRig(clock_error_s=0.012),
        MovingHand(),
        2.5,
        edit=lambda frame: _replace(frame, clock_sigma_ns=-1),
    )
    assert disagreement_ms(estimator) == pytest.approx(24.0, abs=0.3)


def _replace(frame, **fields):
    return msgspec.structs.replace(frame, **fields)


@pytest.mark.parametrize("late_s", [0.02, 0.137, -0.05])
def test_clocks_are_doubted_once_heights_contradict_what_was_learned(late_s):
    setup = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)
    right = frames(setup, MovingHand(), 16.0)
    cameras, builder = setup.rig(), ObservationBuilder(setup.config(), setup.rig())
    estimator = ClockOffsetEstimator(tuple(cameras.values()), 6, np.full(2, 1 / FPS), enabled=True)
    late = with_clock_error(right, "right", late_s)
    doubted: list[tuple[float, bool]] = []
    for frame in [*right[: len(right) // 2], *late[len(late) // 2 :]]:
        view = builder.build(frame)
        time_s = (view.instant_ns - START_NS) * 1e-9
        estimator.observe(view, time_s + view.delay_s)
        doubted.append((time_s, estimator.doubted))
    # Now and then no two views can be compared.
    before = [told for time_s, told in doubted if 1.0 < time_s < 7.9]
    assert sum(before) < 0.05 * len(before)
    assert any(told for time_s, told in doubted if 8.0 < time_s < 11.0)


def test_a_still_hand_tells_nothing_about_clocks():
    estimator = estimate(
        SyntheticRig(clock_error_s=0.001, clock_sigma_s=0.001), MovingHand(speed_m_s=0.0), 4.0
    )
    assert abs(disagreement_ms(estimator)) < 0.1
    assert estimator.observe(*_nothing(estimator))[1] == pytest.approx(0.001, rel=0.1)


def _nothing(estimator):
    setup = SyntheticRig(clock_error_s=0.001, clock_sigma_s=0.001)
    builder = ObservationBuilder(setup.config(), setup.rig())
    view = builder.build(_replace(frames(setup, MovingHand(), 0.1)[0], markers=[]))
    return view, view.delay_s


def test_a_bumped_camera_shows_as_a_constant_height():
    def bump(frame):
        lifted = [
            _replace(marker, y_px=marker.y_px + 1.5 * (frame.camera == "right"))
            for marker in frame.markers
        ]
        return _replace(frame, markers=lifted)

    estimator = estimate(
        SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4), MovingHand(), 4.0, edit=bump
    )
    assert estimator.heights_px["left", "right"] == pytest.approx(-1.5, abs=0.2)
    assert abs(disagreement_ms(estimator)) < 0.2


def test_switched_off_it_only_watches():
    estimator = estimate(SyntheticRig(clock_error_s=0.002), MovingHand(), 3.0, enabled=False)
    assert disagreement_ms(estimator) == 0.0
    assert estimator.epipolar_px > 0.3


def test_a_clock_that_is_set_begins_anew():
    setup = SyntheticRig(clock_error_s=0.003, clock_sigma_s=0.003)
    given, path = frames(setup, MovingHand(), 6.0), MovingHand()

    def corrected(frame):
        """After 3 s the right camera's clock estimate jumps to the truth, as the left's."""
        late = frame.stamp_ns - START_NS > 3_000_000_000
        return _replace(
            frame,
            clock_offset_ns=frame.clock_offset_ns
            - late * (3_000_000 if frame.camera == "left" else -3_000_000),
        )

    assert given
    estimator = estimate(setup, path, 6.0, edit=corrected)
    assert disagreement_ms(estimator) == pytest.approx(0.0, abs=0.15)


def test_three_cameras_learn_from_every_pair():
    estimator = estimate(
        SyntheticRig(cameras=3, phase_s=1 / 90, clock_error_s=0.002, clock_sigma_s=0.004),
        MovingHand(),
        6.0,
    )
    late = estimator.late_s
    assert 1e3 * (late["right"] - late["left"]) == pytest.approx(4.0, abs=0.2)
    assert 1e3 * (late["camera3"] - late["left"]) == pytest.approx(0.0, abs=0.2)


def test_correction_is_worth_millimetres(run):
    setup, path = SyntheticRig(clock_error_s=0.003, clock_sigma_s=0.003), MovingHand()
    _, tuned = run(setup, path, Fusion(lag_frames=2))
    _, plain = run(setup, path, Fusion(lag_frames=2, tune_clocks=False))
    # Even untuned, a claimed uncertainty of the clocks makes the filter distrust the direction of
    # motion, and a hand that keeps its shape tells its depth: 6 ms would be 16 mm otherwise.
    assert tuned.rms_mm < 0.8
    assert plain.rms_mm > 1.5 * tuned.rms_mm


TRUE = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)


@pytest.mark.parametrize("sigma_ns", [100_000, 5_000_000, -1])
@pytest.mark.parametrize("motion", [stop_and_go(20.0, 3), flapping(1.5, 55.0, 3)])
def test_sharp_turns_do_not_pass_for_clocks(motion, sigma_ns):
    """What interpolation misses where an acceleration jumps is in what is claimed."""
    given = with_clock_error(frames(TRUE, motion, 9.0), "right", 0.0, sigma_ns)
    told = learn(TRUE, given)[1]
    late = told[told[:, 0] > 2.0]
    assert np.abs(late[:, 1]).max() < 0.6
    assert np.mean((late[:, 1] / late[:, 2]) ** 2) < 2.0


@pytest.mark.parametrize("sigma_ns", [100_000, 5_000_000, -1])
@pytest.mark.parametrize("sigma_px", [1.0, 3.0])
@pytest.mark.parametrize("speed_m_s", [0.2, 0.5])
def test_errors_that_last_for_some_frames_do_not_pass_for_clocks(speed_m_s, sigma_px, sigma_ns):
    path = MovingHand(speed_m_s=speed_m_s)
    given = with_clock_error(frames(TRUE, path, 9.0), "right", 0.0, sigma_ns)
    estimator, told = learn(TRUE, with_correlated_errors(given, sigma_px))
    assert np.abs(told[told[:, 0] > 2.0, 1]).max() < 3.0
    assert estimator.moved_px == {}


@pytest.mark.parametrize("frozen", [False, True])
@pytest.mark.parametrize("camera", ["left", "right"])
def test_two_seconds_of_wrong_markers_are_bounded_and_unlearned(camera, frozen):
    given = frames(TRUE, flapping(1.5, 55.0, 3), 9.0)
    given = with_static_markers(given, camera, (3.0, 5.0), frozen=frozen)
    estimator, told = learn(TRUE, given)
    assert np.abs(told[:, 1]).max() <= 5.0
    assert np.abs(told[told[:, 0] > 7.0, 1]).max() < 0.3
    assert estimator.moved_px == {}


def test_motion_outweighs_a_sigma_that_is_announced_too_small():
    given = with_clock_error(frames(TRUE, MovingHand(), 6.0), "right", 0.004)
    estimator, told = learn(TRUE, given)
    assert disagreement_ms(estimator) == pytest.approx(4.0, abs=0.2)
    assert told[-1, 2] < 0.3
    # Farther off than a few milliseconds it is not this estimator's matter.
    bounded = learn(TRUE, with_clock_error(frames(TRUE, MovingHand(), 6.0), "right", 0.05))[0]
    assert abs(disagreement_ms(bounded)) <= 5.0
