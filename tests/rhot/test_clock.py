import random

import pytest

from rhot.clock import OffsetEstimator

START_NS = 1_700_000_000_000_000_000


def exchanges(estimator, seconds, offset_ns, drift_ppm=0.0, start_s=0, seed=1, asymmetry=0.0):
    """One exchange a second over a link of 0.3 ms each way with queueing delays now and then."""
    rng = random.Random(seed)
    for second in range(start_s, start_s + seconds):
        master_ns = START_NS + second * 1_000_000_000

        def own(at_ns):
            return at_ns + offset_ns + int(drift_ppm * 1e-6 * (at_ns - START_NS))

        out_ns = 300_000 + int(rng.expovariate(1 / 200_000)) + int(asymmetry * 300_000)
        back_ns = 300_000 + int(rng.expovariate(1 / 200_000))
        estimator.update(own(master_ns - out_ns), master_ns, own(master_ns + back_ns))
    return own(master_ns), own(master_ns) - master_ns


def test_unknown_before_the_first_exchange():
    assert OffsetEstimator().at(START_NS).sigma_ns == -1


@pytest.mark.parametrize(
    ("offset_ns", "drift_ppm"),
    [(0, 0.0), (20_000_000, 0.0), (-3_600_000_000_000, 50.0), (5_000_000, -80.0)],
)
def test_finds_offset_and_drift(offset_ns, drift_ppm):
    estimator = OffsetEstimator()
    own_ns, true_ns = exchanges(estimator, 60, offset_ns, drift_ppm)
    estimate = estimator.at(own_ns)
    assert abs(estimate.offset_ns - true_ns) < 150_000
    assert abs(estimate.offset_ns - true_ns) < 4 * estimate.sigma_ns
    later = estimator.at(own_ns + 10_000_000_000)
    assert abs(later.offset_ns - (true_ns + drift_ppm * 1e-6 * 10e9)) < 4 * later.sigma_ns


def test_uncertainty_grows_while_no_answer_comes():
    estimator = OffsetEstimator()
    own_ns, _ = exchanges(estimator, 30, 0)
    assert estimator.at(own_ns + 30_000_000_000).sigma_ns > 2 * estimator.at(own_ns).sigma_ns


def test_asymmetric_delay_stays_within_the_half_delay_and_is_admitted():
    estimator = OffsetEstimator()
    own_ns, true_ns = exchanges(estimator, 60, 0, asymmetry=2.0)
    estimate = estimator.at(own_ns)
    assert abs(estimate.offset_ns - true_ns) < 3 * estimate.sigma_ns


def test_one_late_answer_changes_nothing_but_a_set_clock_is_followed():
    estimator = OffsetEstimator()
    own_ns, _ = exchanges(estimator, 30, 1_000_000)
    before = estimator.at(own_ns)
    estimator.update(own_ns, own_ns - 900_000_000, own_ns + 100_000)
    assert estimator.at(own_ns) == before
    own_ns, true_ns = exchanges(estimator, 5, 1_001_000_000, start_s=31)
    assert abs(estimator.at(own_ns).offset_ns - true_ns) < 1_000_000


def test_a_clock_that_ran_backwards_during_the_exchange_is_ignored():
    estimator = OffsetEstimator()
    estimator.update(START_NS, START_NS, START_NS - 1)
    assert estimator.at(START_NS).sigma_ns == -1


def test_a_step_that_is_known_is_followed_at_once():
    estimator = OffsetEstimator()
    exchanges(estimator, seconds=30, offset_ns=5_000_000, drift_ppm=20.0)
    before = estimator.at(30 * 10**9)
    estimator.follow_step(-(2 * 10**9))
    after = estimator.at(28 * 10**9)
    assert after.offset_ns == pytest.approx(before.offset_ns - 2 * 10**9, abs=1000)
    assert after.sigma_ns == pytest.approx(before.sigma_ns, rel=0.01)


def test_an_exchange_that_contradicts_is_doubted_until_more_tell():
    estimator = OffsetEstimator()
    exchanges(estimator, seconds=10, offset_ns=0)
    assert not estimator.doubted
    estimator.update(11 * 10**9, 9 * 10**9, 11 * 10**9 + 500_000)
    assert estimator.doubted
    estimator.update(12 * 10**9, 12 * 10**9 + 250_000, 12 * 10**9 + 500_000)
    assert not estimator.doubted
