"""The asynchronous estimator's tracks: how they begin, go on and end."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import Fusion
from services.fusion.kalman.estimator import SHOW_SIGMA_M
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

EXACT = SyntheticRig(clock_error_s=0.0, clock_sigma_s=2e-5, loss=0.0)


def test_sigmas_of_the_first_points_of_a_track_are_consistent(bench_of):
    """Test: 30 hands come into view at 0.5 m/s.

    Expected: the second to tenth instants are within their sigmas, bar a little.
    """
    squared = []
    for seed in range(30):
        path, bench = (
            MovingHand(seed=seed),
            bench_of(SyntheticRig(seed=seed, clock_error_s=0.0, clock_sigma_s=2e-5)),
        )
        for frame in frames(
            SyntheticRig(seed=seed, clock_error_s=0.0, clock_sigma_s=2e-5), path, 0.4
        ):
            instant_s = bench.see(frame)
            found = bench.method.estimate(instant_s)
            error = (found.positions_m - path(np.array([instant_s]))[0])[found.found]
            sigma = np.sqrt(np.einsum("nii->ni", found.covariances_m2))[found.found]
            squared.append(((error / sigma) ** 2).ravel())
    assert np.concatenate(squared).mean() < 1.3


def test_nothing_is_shown_before_it_is_of_use(bench_of):
    bench, path = bench_of(EXACT), MovingHand()
    shown = []
    for frame in frames(EXACT, path, 0.2):
        found = bench.method.estimate(bench.see(frame))
        shown.append(found.found.all())
        depth_sigmas = np.sqrt(found.covariances_m2[found.found, 2, 2])
        assert (depth_sigmas <= SHOW_SIGMA_M).all()
    assert not shown[0]
    assert all(shown[4:])


def test_one_camera_alone_begins_nothing(bench_of):
    bench = bench_of(EXACT)
    for frame in frames(EXACT, MovingHand(), 1.0):
        if frame.camera == "left":
            assert not bench.method.estimate(bench.see(frame)).found.any()
    assert bench.method.counts.started == 0


def test_a_wild_observation_is_gated_and_the_track_goes_on(bench_of):
    bench, path = bench_of(EXACT), MovingHand()
    given = frames(EXACT, path, 2.0)
    given[100] = msgspec.structs.replace(
        given[100],
        markers=[msgspec.structs.replace(m, x_px=m.x_px * 0.9) for m in given[100].markers],
    )
    for frame in given:
        instant_s = bench.see(frame)
    assert bench.method.counts.gated == 6
    assert bench.method.counts.dropped == 0
    error = bench.method.estimate(instant_s).positions_m - path(np.array([instant_s]))[0]
    assert np.abs(error).max() < 0.02


def test_a_marker_that_jumps_for_good_is_found_again(bench_of):
    bench = bench_of(EXACT)
    for frame in frames(EXACT, MovingHand(), 1.0):
        bench.see(frame)
    elsewhere = MovingHand(distance_m=0.5, seed=9)
    for frame in frames(EXACT, elsewhere, 1.5):
        if (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 > 1.0:
            instant_s = bench.see(frame)
    error = bench.method.estimate(instant_s).positions_m - elsewhere(np.array([instant_s]))[0]
    assert np.abs(error).max() < 0.01
    assert bench.method.counts.started == 12


def test_hold_is_at_least_the_gap_between_two_frames(bench_of):
    bench = bench_of(EXACT, Fusion(hold_s=0.0))
    found = [
        bench.method.estimate(bench.see(frame)).found.all()
        for frame in frames(EXACT, MovingHand(), 1.0)
    ]
    assert all(found[10:])


def test_cameras_that_were_never_there_do_not_matter(bench_of):
    bench = bench_of(
        SyntheticRig(cameras=4, phase_s=1 / 120, clock_error_s=0.0, clock_sigma_s=2e-5)
    )
    for frame in frames(
        SyntheticRig(cameras=4, phase_s=1 / 120, clock_error_s=0.0, clock_sigma_s=2e-5),
        MovingHand(),
        1.0,
    ):
        if frame.camera in ("right", "camera4"):
            instant_s = bench.see(frame)
    found = bench.method.estimate(instant_s)
    assert found.measured.all()
    assert found.seen_by.sum(axis=0).tolist() == [0, 6, 0, 6]
    assert found.positions_m[:, 2] == pytest.approx(
        MovingHand()(np.array([instant_s]))[0][:, 2], abs=0.01
    )


def test_a_camera_far_later_than_the_other_takes_part(bench_of):
    """Test: one camera's frames arrive .2 s after the other's.

    Expected: tracks start, and where both have seen the hand, they are as exact.
    """
    bench, path = bench_of(EXACT, Fusion(hold_s=0.5)), MovingHand()
    late_s, errors = {"left": 0.0, "right": 0.2}, []
    given = frames(EXACT, path, 3.0)
    given.sort(
        key=lambda frame: (
            (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9 + late_s[frame.camera]
        )
    )
    for frame in given:
        instant_s = bench.see(frame)
        if instant_s > 1.0 and frame.camera == "right":
            found = bench.method.estimate(instant_s)
            assert found.found.all()
            errors.append(found.positions_m - path(np.array([instant_s]))[0])
    assert bench.method.counts.dropped == 0
    assert 1e3 * np.sqrt(np.mean(np.sum(np.array(errors) ** 2, axis=2))) < 2.0
