"""The RHOT paper's depth law."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.calibrator.depth_law.bench import BenchErrors, simulate_bench
from services.calibrator.depth_law.fit import PAPER_K, PAPER_Z, fit_depth
from services.calibrator.depth_law.report import depth_text

# Together they give the paper's k and z.
DIVERGENCE_RAD, ZERO_CM = np.radians(0.095), 1.02


def test_ideal_cameras_give_the_geometric_law():
    law = fit_depth(*simulate_bench())
    assert law.k == pytest.approx(527.3 * 7.5, rel=1e-6)
    assert law.z == pytest.approx(-1.0, abs=1e-6)
    assert law.phi_rad == pytest.approx(0.0, abs=1e-4)
    assert law.divergence_rad == pytest.approx(0.0, abs=1e-9)
    assert law.zero_cm == pytest.approx(0.0, abs=1e-6)


def test_the_papers_numbers_follow_from_a_tenth_of_a_degree_and_a_centimetre():
    """Test: cameras .095 degrees apart, the tape's zero 10.2 mm in front of the optical centres.
    Expected: the paper's k and z.

    One cause alone cannot give both: turned cameras of z = -1.035 have k = 4794, a displaced zero
    of that z has k = 4382.
    """
    law = fit_depth(*simulate_bench(BenchErrors(divergence_rad=DIVERGENCE_RAD, zero_cm=ZERO_CM)))
    assert law.k == pytest.approx(PAPER_K, rel=0.01)
    assert law.z == pytest.approx(PAPER_Z, abs=0.002)
    turned = fit_depth(*simulate_bench(BenchErrors(divergence_rad=np.radians(0.3))))
    assert (turned.k, turned.z) == (
        pytest.approx(4794.0, rel=0.01),
        pytest.approx(PAPER_Z, abs=0.001),
    )


@pytest.mark.parametrize("random_seed", range(5))
def test_a_noisy_bench_lands_near_the_papers_and_names_the_causes(random_seed):
    """Test: .2 px of noise, target placed to 1 mm.

    Expected: k within 3 %, z within .008, and the causes found again.
    """
    errors = BenchErrors(divergence_rad=DIVERGENCE_RAD, zero_cm=ZERO_CM, noise_px=0.2, tape_cm=0.1)
    law = fit_depth(*simulate_bench(errors, random_seed=random_seed))
    assert law.k == pytest.approx(PAPER_K, rel=0.03)
    assert law.z == pytest.approx(PAPER_Z, abs=0.008)
    assert np.degrees(law.divergence_rad) == pytest.approx(0.095, abs=0.03)
    assert law.zero_cm == pytest.approx(1.02, abs=0.25)
    assert np.sqrt(np.mean(np.square(law.explained_cm))) < 0.6


def test_the_power_law_corrects_what_the_geometric_law_cannot():
    law = fit_depth(*simulate_bench(BenchErrors(divergence_rad=np.radians(0.3))))
    assert np.abs(law.power_cm).max() < 0.5 * np.abs(law.geometry_cm).max()
    assert "k = 4" in depth_text(law)
    assert "[fusion.disparity]" in depth_text(law)


def test_phi_makes_equation_10_meet_the_measurements():
    law = fit_depth(*simulate_bench(BenchErrors(zero_cm=0.5)))
    k = 7.5 * 640 / (2.0 * np.tan(np.arctan(320.0 / 527.3) + law.phi_rad))
    np.testing.assert_allclose(
        np.array(law.distances_cm) + np.array(law.geometry_cm),
        k / np.array(law.disparities_px),
        rtol=1e-9,
    )


@pytest.mark.parametrize(
    ("distances", "disparities", "reason"),
    [
        ([100.0, 50.0], [40.0, 80.0], "too few"),
        ([100.0, 99.0, 98.0, 97.0, 96.0], [40.0, 41.0, 42.0, 43.0, 44.0], "too close together"),
        ([100.0, 80.0, 60.0, 40.0, 20.0], [40.0, 35.0, 30.0, 25.0, 20.0], "do not fall"),
        ([100.0, 80.0, 60.0, 40.0, float("inf")], [40.0, 50.0, 60.0, 70.0, 80.0], "positive"),
    ],
)
def test_measurements_that_determine_no_law_are_refused(distances, disparities, reason):
    with pytest.raises(CalibrationError, match=reason):
        fit_depth(distances, disparities)
