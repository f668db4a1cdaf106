"""The noise of sightings: the banded elimination against dense matrices, and what is learnt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from services.calibrator.objects.bundle.reprojection import reproject
from services.calibrator.objects.bundle.tracker_noise import Noise, Whitened, fit_noise
from tests.services.calibrator.objects.bundle.test_reprojection import two_trackers


def dense(at, result, noise):
    """The covariance (2 n, 2 n) of all residuals."""
    apart = np.abs(at.stamps_s[:, None] - at.stamps_s)
    same = at.tracker[:, None] == at.tracker
    kernel = noise.tracker_m**2 * np.exp(-apart / noise.tau_s) * same
    H = result.by_point
    V = np.einsum("iax,ij,jbx->iajb", H, kernel, H).reshape(2 * len(H), -1)
    return V + np.diag(np.repeat(noise.camera * at.sigma_px**2, 2))


@pytest.fixture
def residuals():
    at, unknowns = two_trackers()
    some = np.arange(len(at.stamps_s)) % 3 == 0
    at = at.only(some)
    return at, reproject(at, unknowns, np.zeros(3))


def test_elimination_is_the_inverse_of_the_dense_covariance(residuals):
    at, result = residuals
    noise = Noise(1.3, 1.1e-3, 0.2)
    V = dense(at, result, noise)
    whitened = Whitened(at, result, noise, np.ones(len(at.stamps_s)))
    r = result.residual_px.reshape(-1)
    solved = whitened.times(result.residual_px[..., None])[0].reshape(-1)
    assert solved == pytest.approx(np.linalg.solve(V, r), rel=1e-4, abs=1e-6)
    expected = r @ np.linalg.solve(V, r) + np.linalg.slogdet(V)[1]
    assert whitened.cost(result.residual_px) == pytest.approx(expected, rel=1e-5)


def test_noise_is_learnt_from_residuals():
    at, unknowns = two_trackers()
    result = reproject(at, unknowns, np.zeros(3))
    truth = Noise(1.0, 1.5e-3, 0.3)
    at = replace(at, sigma_px=np.full(len(at.stamps_s), 0.2))
    factor = np.linalg.cholesky(dense(at, result, truth))
    random = np.random.default_rng(4)
    found = []
    for _ in range(5):
        drawn = (factor @ random.normal(size=len(factor))).reshape(-1, 2)
        sample = replace(result, residual_px=drawn)
        everyone = np.ones(len(at.stamps_s), dtype=bool)
        found.append(fit_noise(at, sample, everyone, Noise(3.0, 5e-4, 0.05)))
    camera, tracker_m, tau_s = np.median(np.array(found), axis=0)
    assert camera == pytest.approx(1.0, rel=0.4)
    assert tracker_m == pytest.approx(1.5e-3, rel=0.3)
    assert 0.1 < tau_s < 0.9
