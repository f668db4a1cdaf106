"""How far a hand model is believed: from what its fits cost."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.whole_hand.model_misfit import learned_misfit

FRAME_S, OWN_M2 = 1.0 / 30.0, 1e-6


def _whitening(variance_m2: float) -> Array:
    """Of six landmarks; (6, 3, 3)."""
    return np.tile(np.eye(3) / np.sqrt(variance_m2), (6, 1, 1))


def _after(frames: int, true_m2: float, misfit_m2: float = 0.0) -> float:
    """The misfit after fits whose errors have a variance of OWN_M2 + true_m2; half is absorbed."""
    for _ in range(frames):
        cost = 0.5 * 18 * (OWN_M2 + true_m2) / (OWN_M2 + misfit_m2)
        misfit_m2 = learned_misfit(misfit_m2, _whitening(OWN_M2 + misfit_m2), cost, FRAME_S)
    return misfit_m2


def test_bones_that_are_right_have_no_misfit() -> None:
    assert _after(300, 0.0) == 0.0


def test_wrong_bones_are_found_within_a_second_and_remembered() -> None:
    found = _after(30, 5e-3**2)
    assert np.isclose(np.sqrt(found), 5e-3, rtol=0.1)
    assert _after(60, 0.0, found) > 0.7 * found


def test_what_one_camera_sees_does_not_excuse_the_model() -> None:
    rays = _whitening(OWN_M2 + 5e-3**2)
    rays[:3, 2, 2] = 1.0
    assert learned_misfit(5e-3**2, rays, 4.0, 1.0) > 0.7 * 5e-3**2


def test_one_absurd_fit_hardly_counts_and_nothing_counts_for_ever() -> None:
    assert np.sqrt(learned_misfit(0.0, _whitening(OWN_M2), 1e9, FRAME_S)) < 1e-3
    assert np.sqrt(_after(10**4, 1.0)) <= 0.02
    assert learned_misfit(1e-6, np.empty((0, 3, 3)), 0.0, FRAME_S) == 1e-6
