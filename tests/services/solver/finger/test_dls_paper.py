"""The finger study's damped least squares, as we read it, and what the other readings do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.hand import default_hand
from services.solver.finger import dls_paper as paper
from services.solver.finger.dls import NOT_CONVERGED
from services.solver.maths.chains import digit_chain, hand_chains, scale_chain
from services.solver.maths.kinematics import tip_jacobian

INDEX = digit_chain(hand_chains(default_hand()), 1)


def _follow(
    grasp: np.ndarray, options: paper.Options, tip_pose: Callable
) -> tuple[list[paper.Solution], float]:
    q, frames, last = np.array(paper.INITIAL_ANGLES_RAD), [], 0.0
    for angles in grasp:
        frame = paper.solve(INDEX, *tip_pose(INDEX, angles), q, options)
        q = frame.angles_rad
        frames.append(frame)
        last = float(np.abs(q - angles).max())
    return frames, last


@pytest.mark.parametrize("form", ["normal", "svd"])
def test_the_studys_order_of_iterations(
    form: paper.Form, grasp: Callable, tip_pose: Callable
) -> None:
    rng = np.random.default_rng(1)
    first, later, worst = [], [], []
    for _ in range(20):
        frames, error = _follow(grasp(rng), paper.Options(form=form), tip_pose)
        first.append(frames[0].iterations)
        later.extend(frame.iterations for frame in frames[1:])
        worst.append(error)
    assert min(first) > 10
    assert max(first) <= 40
    assert min(later) >= 3
    assert np.percentile(later, 90) <= 10
    assert np.median(worst) < np.deg2rad(0.1)


def test_taken_literally_it_does_not_stay_in_the_limits(
    grasp: Callable, tip_pose: Callable
) -> None:
    """Only the damping keeps the angles in their range, and from the study's start it does not."""
    rng = np.random.default_rng(2)
    for _ in range(5):
        frames, _ = _follow(grasp(rng), paper.Options(clip=False), tip_pose)
        assert frames[-1].angles_rad[2] < -0.01 or np.abs(frames[-1].angles_rad).max() > np.pi


def test_the_printed_filter_diverges_near_a_singularity() -> None:
    """sigma / (sigma + lambda^2), as printed, tends to 1, not to 1 / sigma: the unit is wrong."""
    p, J = np.empty(3), np.empty((6, 4))
    tip_jacobian(scale_chain(INDEX, 1e3), np.array([0.0, 0.5, 0.5, 0.3]), p, J)
    e = J @ np.array([0.0, 1e-3, 1e-3, 1e-3])
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    printed = Vt.T @ (sigma / (sigma + 0.01) * (U.T @ e))
    ours = paper.step(J, e, np.full(6, 0.1), "svd")
    assert np.linalg.norm(printed) > 20.0 * np.linalg.norm(ours)
    np.testing.assert_allclose(ours, [0.0, 1e-3, 1e-3, 1e-3], atol=5e-5)


def test_both_forms_agree_far_from_limits() -> None:
    p, J = np.empty(3), np.empty((6, 4))
    q = INDEX.limits.mean(axis=1)
    tip_jacobian(scale_chain(INDEX, 1e3), q, p, J)
    factors = paper.damping(q, INDEX.limits)
    np.testing.assert_allclose(factors, [0.0, 0.0, 0.0, 0.0, 0.7, 0.7], atol=1e-12)
    e = J @ np.array([0.01, 0.02, -0.01, 0.01])
    np.testing.assert_allclose(
        paper.step(J, e, factors, "svd"), [0.01, 0.02, -0.01, 0.01], atol=1e-12
    )
    np.testing.assert_allclose(
        paper.step(J, e, factors, "normal"), [0.01, 0.02, -0.01, 0.01], atol=2e-3
    )


def test_damping_grows_at_the_limits() -> None:
    at_limit = paper.damping(INDEX.limits[:, 1], INDEX.limits)
    np.testing.assert_allclose(at_limit[:4], 1.0)
    beyond = paper.damping(INDEX.limits[:, 1] + 0.2, INDEX.limits)
    assert np.all(beyond[:4] > 1.5)
    fixed = np.array([[0.0, 0.0], *INDEX.limits[1:]])
    assert np.isfinite(paper.damping(np.array([0.0, 9.0, 9.0, 9.0]), fixed)).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_absurd_targets(bad: float) -> None:
    frame = paper.solve(
        INDEX, np.full(3, bad), np.eye(3), np.array([9.0, 0.1, 0.1, 0.1]), paper.Options()
    )
    assert frame.outcome == NOT_CONVERGED
    assert np.all(frame.angles_rad <= INDEX.limits[:, 1])
