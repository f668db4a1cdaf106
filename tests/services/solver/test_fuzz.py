"""Whatever comes in: limits are kept, nothing that is not finite comes out, every loop ends.

See also test_step.test_absurd_input.
"""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Solver
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS, JOINTS, HandModel, default_hand
from rhot.messages import HandPoint, HandPoints
from services.solver.finger import dls, dls_paper
from services.solver.finger.dls_equations import COUPLED, tip_goal
from services.solver.finger.outcome import SOLVED
from services.solver.finger.solve_fingers import MEASURED, Tips, solve_fingers
from services.solver.maths.box_qp import box_qp, workspace
from services.solver.maths.chains import digit_chain, hand_chains
from services.solver.maths.kinematics import tip_distance
from services.solver.step import SolverStep
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.initialise import initialise
from services.solver.whole_hand.landmarks import (
    Observation,
    hand_landmarks,
    observation_arrays,
)
from services.solver.whole_hand.priors.motion_prior import uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior

MODEL = default_hand()
CHAINS = hand_chains(MODEL)
LOW, HIGH = MODEL.limits_rad[..., 0], MODEL.limits_rad[..., 1]
METHODS = ("dls", "fabrik", "analytic", "dls-paper", "fabrik-paper")
few = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
wild = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 1e300, -1e300, 1e-300, 0.05, -0.05]),
)
# What point_check.py lets through: within ten metres, sigma from 0.3 mm to 0.15 m.
near = st.one_of(st.floats(-10.0, 10.0), st.floats(-0.2, 0.2), st.just(0.0))
inverse = st.floats(1.0 / 0.45, 1.0 / 3e-4)


def _inside(angles: Array) -> bool:
    return bool(np.all(angles >= LOW) and np.all(angles <= HIGH))


@few
@given(
    st.lists(st.tuples(wild, wild, wild), min_size=5, max_size=5),
    st.lists(wild, min_size=20, max_size=20),
    wild,
    st.sampled_from(METHODS),
)
def test_all_fingers(points: list, start: list[float], sigma: float, method: str) -> None:
    tips = Tips(np.array(points), np.full(5, abs(sigma)), np.full(5, MEASURED))
    found = solve_fingers(Solver(method=method), CHAINS, np.array(start).reshape(5, 4), tips)
    assert _inside(found.angles_rad)
    assert np.all(found.ends[:, 1] < np.inf)
    assert found.ends[:, 0].max() <= 3 * Solver().max_iterations
    for point, status in zip(tips.points_m, found.status, strict=True):
        assert status != SOLVED or np.all(np.isfinite(point))


@few
@given(
    st.lists(wild, min_size=3, max_size=3),
    st.lists(wild, min_size=9, max_size=9),
    st.lists(wild, min_size=4, max_size=4),
    st.booleans(),
)
def test_the_study_algorithm(
    point: list[float], rotation: list[float], start: list[float], svd: bool
) -> None:
    chain = digit_chain(CHAINS, 1)
    options = dls_paper.Options(form="svd" if svd else "normal", max_iterations=50)
    q = np.clip(np.nan_to_num(start, nan=0.5), LOW[1], HIGH[1])
    end = dls_paper.solve(chain, np.array(point), np.array(rotation).reshape(3, 3), q, options)
    assert np.all(end.angles_rad >= LOW[1])
    assert np.all(end.angles_rad <= HIGH[1])
    assert end.iterations <= 50
    assert np.isfinite(end.residual_m)


@few
@given(st.integers(0, 2**32 - 1), st.floats(-300.0, 300.0), st.booleans())
def test_a_box_keeps_its_solution(seed: int, decades: float, broken: bool) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(4, 4)) * 10.0 ** min(decades, 150.0)
    H, g, x = A @ A.T, rng.normal(size=4) * 10.0**decades, np.empty(4)
    if broken:
        H[rng.integers(4), rng.integers(4)] = rng.choice([np.nan, np.inf, -1.0])
    low = rng.uniform(-1.0, 0.0, 4)
    high = low + rng.choice([0.0, 1.0], 4)
    box_qp(H, g, low, high, x, workspace(4))
    assert np.all(x >= low)
    assert np.all(x <= high)


@few
@given(st.lists(st.tuples(st.tuples(near, near, near), inverse), min_size=6, max_size=6))
def test_an_initialisation_from_nonsense(found: list) -> None:
    observed = {
        name: Observation(np.array(p), np.eye(3) / s**2, True)
        for name, (p, s) in zip(BASIC_LANDMARKS, found, strict=True)
    }
    observations = observation_arrays(hand_landmarks(MODEL), observed)
    prior = uninformed_prior(posture_prior(MODEL))
    cost, (R, t, q), information = initialise(CHAINS, prior, observations)[0]
    assert _inside(q)
    assert np.isfinite(cost)
    assert np.all(np.isfinite(t))
    assert np.all(np.isfinite(information))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-6)


messages = st.lists(
    st.tuples(
        st.integers(0, 2 * 10**9),
        st.dictionaries(st.sampled_from(BASIC_LANDMARKS), st.tuples(near, near, near, inverse)),
    ),
    max_size=5,
)


@few
@given(messages)
def test_a_hand_followed_through_nonsense(messages: list) -> None:
    tracker, stamp = HandTracker(MODEL, hand_landmarks(MODEL)), 0
    start = {
        name: (0.01 * i, 0.05 if i else 0.0, 0.5, 1e3) for i, name in enumerate(BASIC_LANDMARKS)
    }
    for wait, points in [(0, start), *messages]:
        stamp += wait
        observed = {
            name: Observation(np.array(v[:3]), np.eye(3) / v[3] ** 2, True)
            for name, v in points.items()
        }
        estimate = tracker.track(stamp, observed)
        if estimate is not None:
            assert _inside(estimate.angles_rad)
            assert np.all(np.isfinite(estimate.covariance))
            assert np.all(np.diag(estimate.covariance) > 0.0)
            assert np.all(np.isfinite(estimate.position_m))
            np.testing.assert_allclose(
                estimate.rotation @ estimate.rotation.T, np.eye(3), atol=1e-6
            )


number = st.one_of(st.floats(-0.2, 0.2), st.sampled_from([0.0, 1e-12]))
length = st.one_of(st.floats(0.0, 0.2), st.sampled_from([0.0, 1e-12]))
angle = st.floats(-3.2, 3.2)


@st.composite
def people(draw: st.DrawFn) -> HandModel:
    """Hands as a file may describe them: any lengths, knuckles, limits, couplings."""
    digits = []
    for digit in MODEL.digits:
        fields = {
            "lengths_m": draw(st.tuples(length, length, length)),
            "base_m": draw(st.tuples(number, number, number)),
        }
        fields |= {
            "limits_rad": draw(st.tuples(*(st.tuples(angle, angle),) * 4))
            if draw(st.booleans())
            else digit.limits_rad
        }
        fields |= {
            "coupling": draw(st.floats(-2.0, 2.0)),
            "coupling_weight": draw(st.floats(-0.1, 10.0)),
        }
        digits.append(msgspec.structs.replace(digit, **fields))
    return msgspec.structs.replace(MODEL, digits=tuple(digits))


@few
@given(
    people(),
    st.lists(st.tuples(near, near, near), min_size=6, max_size=6),
    st.sampled_from(METHODS),
)
def test_any_hand_that_a_file_may_describe(model: HandModel, found: list, method: str) -> None:
    """A model is refused as a CalibrationError, or followed within its own limits."""
    try:
        step = SolverStep(RigConfig(solver=Solver(method=method)), {"right": model})
    except CalibrationError:
        return
    points = [
        HandPoint(name=name, position_m=p, sigma_m=(1e-3,) * 3, cameras=[], source="measured")
        for name, p in zip(BASIC_LANDMARKS, found, strict=True)
    ]
    for seq in range(2):
        pose = step.step(
            HandPoints(hand="right", seq=seq, stamp_ns=seq * 33_000_000, points=points)
        )
        if pose is not None:
            assert b"null" not in msgspec.json.encode(pose)
            for finger, limits in zip(pose.fingers, model.limits_rad, strict=True):
                q = finger.model_angles_rad
                assert np.all((np.array(q) >= limits[:, 0]) & (np.array(q) <= limits[:, 1]))
            assert len(pose.joints) == len(JOINTS)


@pytest.mark.parametrize(
    "bones", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.02), (1e-12, 0.0, 0.0), (0.04, 0.0, 0.0)]
)
@pytest.mark.parametrize(
    "point", [(0.0, 0.0, 0.0), (0.0, 0.0, -1e-15), (0.0, 0.0, 1e300), (0.0, -0.02, 0.0)]
)
def test_targets_at_the_root_of_bones_without_length(
    bones: tuple[float, ...], point: tuple[float, ...]
) -> None:
    chain = digit_chain(CHAINS, 1)._replace(
        lengths=np.array(bones), tool=np.array([0.0, 0.0, -bones[2]])
    )
    q = np.array([0.0, 0.3, 0.3, 0.2])
    used, left, state = dls.solve(chain, tip_goal(COUPLED, np.array(point)), q, 60, 1e-4)
    assert np.all((q >= chain.limits[:, 0]) & (q <= chain.limits[:, 1]))
    assert used <= 60
    assert np.isfinite(left)
    assert state != SOLVED or (left <= 1e-4 and tip_distance(chain, q, np.array(point)) <= 1e-4)
