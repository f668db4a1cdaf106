"""Clock errors learned from the markers' motion."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from services.fusion.intake.observations import ObservationBuilder
from services.fusion.monitors.clock_offsets import ClockOffsetEstimator
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

FPS = 30.0


def estimate(
    setup: SyntheticRig,
    path: MovingHand,
    seconds: float,
    *,
    enabled: bool = True,
    edit=lambda frame: frame,
) -> ClockOffsetEstimator:
    cameras = setup.rig()
    builder = ObservationBuilder(setup.config(), cameras)
    estimator = ClockOffsetEstimator(
        tuple(cameras.values()), 6, np.full(len(cameras), 1.0 / FPS), enabled=enabled
    )
    for frame in frames(setup, path, seconds):
        view = builder.build(edit(frame))
        estimator.observe(view, (view.instant_ns - START_NS) * 1e-9 + view.delay_s)
    return estimator


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
    assert estimator.heights_px["left_right"] == pytest.approx(-1.5, abs=0.2)
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
    # motion: 6 ms would be 16 mm otherwise.
    assert tuned.rms_mm < 1.0
    assert plain.rms_mm > 2.0
