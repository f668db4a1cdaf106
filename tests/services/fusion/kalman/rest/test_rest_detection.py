"""Hands at rest: what their markers share, and that moving ones do not suffer from it."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from services.fusion.kalman.rest.rest_detection import REST_THRESHOLD
from testing.synthetic_points import COLORS, START_NS, MovingHand, RestingHand, SyntheticRig, frames

RIG = SyntheticRig(clock_error_s=0.0, clock_sigma_s=2e-5, sigma_px=0.1)
ALONE = [[landmark] for landmark in range(6)]


def follow(bench, path, seconds, given=None):
    """Errors and sigmas (n, 6, 3) without lag after two seconds; probabilities of rest (n, 6)."""
    errors, sigmas, probabilities = [], [], []
    for frame in given or frames(RIG, path, seconds):
        instant_s = bench.see(frame)
        found = bench.method.estimate(instant_s)
        probabilities.append(bench.method.rest_probabilities())
        if instant_s > 2.0:
            assert found.found.all()
            errors.append(found.positions_m - path(np.array([instant_s]))[0])
            sigmas.append(np.sqrt(np.einsum("nii->ni", found.covariances_m2)))
    return np.array(errors), np.array(sigmas), np.array(probabilities)


def rms_mm(errors) -> float:
    return 1e3 * float(np.sqrt(np.mean(errors**2)))


@pytest.mark.parametrize(("distance_m", "share"), [(0.5, 0.85), (1.0, 0.65)])
def test_a_resting_hand_is_known_better_than_its_markers_alone(bench_of, distance_m, share):
    """Test: a hand that sways by millimetres.

    Expected: less error in depth and sideways, and sigmas that say so.
    """
    path = RestingHand(distance_m=distance_m)
    together, sigmas, _ = follow(bench_of(RIG), path, 8.0)
    alone, _, _ = follow(bench_of(RIG, hands=ALONE), path, 8.0)
    assert rms_mm(together[..., 2]) < share * rms_mm(alone[..., 2])
    assert rms_mm(together[..., :2]) < 0.9 * rms_mm(alone[..., :2])
    assert 0.5 < np.mean((together / sigmas) ** 2) < 1.4


def test_a_finger_that_plays_is_left_to_itself(bench_of):
    """Test: one of six moves by a centimetre.

    Expected: it is as exact as alone, the others go on sharing their motion.
    """
    path = RestingHand(plays=3)
    together, _, probabilities = follow(bench_of(RIG), path, 6.0)
    alone, _, _ = follow(bench_of(RIG, hands=ALONE), path, 6.0)
    others = [0, 1, 2, 4, 5]
    late = probabilities[len(probabilities) // 2 :]
    assert late[:, 3].mean() < REST_THRESHOLD
    assert late[:, others].mean() > 0.85
    assert rms_mm(together[:, 3]) < 1.1 * rms_mm(alone[:, 3])
    assert rms_mm(together[:, others, 2]) < 0.7 * rms_mm(alone[:, others, 2])


def test_a_moving_hand_is_what_it_is_without_sharing(bench_of):
    path = MovingHand()
    together, _, _ = follow(bench_of(RIG), path, 4.0)
    alone, _, _ = follow(bench_of(RIG, hands=ALONE), path, 4.0)
    assert rms_mm(together) < 1.02 * rms_mm(alone)


def test_rest_is_noticed_within_a_second_and_left_at_once(bench_of):
    """Test: a hand sweeps, rests from the third second on; then it sweeps again.

    Expected: shared when at rest, no error when it starts.
    """
    coming = RestingHand(still_from_s=3.0)
    _, _, probabilities = follow(bench_of(RIG), coming, 5.0)
    assert probabilities[-30:].mean() > 0.85

    def going(times_s):
        """The same backwards."""
        return coming(6.0 - np.asarray(times_s))

    together, sigmas, _ = follow(bench_of(RIG), going, 5.0)
    alone, _, _ = follow(bench_of(RIG, hands=ALONE), going, 5.0)
    assert np.abs(together).max() < 1.3 * np.abs(alone).max()
    assert np.mean((together / sigmas) ** 2) < 1.5


def test_late_frames_have_their_share(bench_of):
    """Test: one camera's frames arrive two frames late.

    Expected: depth as good as in order, but for what the newest would add.
    """
    path = RestingHand()
    given = frames(RIG, path, 8.0)
    late_s = {"left": 0.0, "right": 0.066}
    given.sort(
        key=lambda frame: (
            (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 + late_s[frame.camera]
        )
    )
    bench = bench_of(RIG)
    errors, probabilities = [], []
    for frame in given:
        instant_s = bench.see(frame)
        probabilities.append(bench.method.rest_probabilities())
        if instant_s > 2.0 and frame.camera == "left":
            errors.append(
                bench.method.estimate(instant_s).positions_m - path(np.array([instant_s]))[0]
            )
    assert np.mean(probabilities[120:], axis=0).min() > 0.7
    assert rms_mm(np.array(errors)[..., 2]) < 1.5


def test_frames_too_late_for_the_body_leave_the_landmarks_to_themselves(bench_of):
    """Test: one camera's frames come .15 s late, later than REACH_S.

    Expected: as without sharing, not a body that one camera alone updates.
    """
    path, rms = RestingHand(), []
    given = frames(RIG, path, 6.0)
    late_s = {"left": 0.0, "right": 0.15}
    given.sort(
        key=lambda frame: (
            (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 + late_s[frame.camera]
        )
    )
    for hands in ((range(6),), ALONE):
        bench, errors = bench_of(RIG, Fusion(hold_s=0.5), hands), []
        for frame in given:
            instant_s = bench.see(frame)
            if instant_s > 2.0 and frame.camera == "left":
                errors.append(
                    bench.method.estimate(instant_s).positions_m - path(np.array([instant_s]))[0]
                )
        rms.append(rms_mm(np.array(errors)))
    assert rms[0] < 1.05 * rms[1]


def test_a_hidden_marker_grows_uncertain_in_a_resting_hand(bench_of):
    """Test: nobody sees one marker of six any more. Expected: its sigma grows until it is dropped.

    It may have moved.
    """
    bench, depths = bench_of(RIG), []
    for frame in frames(RIG, RestingHand(), 4.0):
        instant_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
        if instant_s > 3.0:
            frame = msgspec.structs.replace(
                frame, markers=[marker for marker in frame.markers if marker.color != COLORS[3]]
            )
        found = bench.method.estimate(bench.see(frame))
        if instant_s > 2.95 and found.found[3]:
            depths.append(float(np.sqrt(found.covariances_m2[3, 2, 2])))
    assert depths[-1] > 1.5 * depths[0]
    assert not found.found[3]
    assert bench.method.rest_probabilities()[3] == 0.0


def test_each_hand_rests_by_itself(bench_of):
    """Test: the three last landmarks, a hand of their own, move; the first three rest."""
    rest, move = RestingHand(), MovingHand(distance_m=1.0, speed_m_s=0.3)

    def both(times_s):
        return np.concatenate([rest(times_s)[:, :3], move(times_s)[:, 3:]], axis=1)

    _, _, probabilities = follow(bench_of(RIG, hands=([0, 1, 2], [3, 4, 5])), both, 5.0)
    late = probabilities[len(probabilities) // 2 :]
    assert late[:, :3].mean() > 0.7
    assert late[:, 3:].mean() < 0.1


def test_a_body_that_diverged_starts_anew(bench_of):
    bench, path, probabilities = bench_of(RIG), RestingHand(), []
    for number, frame in enumerate(frames(RIG, path, 6.0)):
        instant_s = bench.see(frame)
        probabilities.append(bench.method.rest_probabilities())
        if number == 120:
            bench.method._state.rest.motion[:] = np.inf
    found = bench.method.estimate(instant_s)
    assert found.found.all()
    assert rms_mm(found.positions_m - path(np.array([instant_s]))[0]) < 2.0
    assert np.mean(probabilities[-60:], axis=0).min() > 0.7
