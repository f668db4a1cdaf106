"""The closed form: exact on the coupled family, nearest elsewhere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot.hand import default_hand
from services.solver.finger import analytic, dls
from services.solver.finger.dls_equations import COUPLED, tip_goal
from services.solver.finger.outcome import SOLVED, UNREACHABLE
from services.solver.maths.chains import digit_chain, hand_chains, max_reach
from services.solver.maths.kinematics import tip_position

CHAINS = hand_chains(default_hand())
INDEX = digit_chain(CHAINS, 1)


@pytest.mark.parametrize("row", [0, 1, 2, 3, 4])
def test_exact_where_the_coupling_holds(row: int, within: Callable) -> None:
    chain, rng, errors = digit_chain(CHAINS, row), np.random.default_rng(row), []
    for _ in range(300):
        angles = within(rng, chain.limits, True)
        q = np.zeros(4)
        _, left, state = analytic.solve(chain, tip_position(chain, angles), q, 1e-6)
        assert state == SOLVED
        assert left <= 1e-9
        errors.append(np.abs(q - angles).max())
    # A tip on the axis of abduction, or both branches possible: the angles are not unique there.
    assert np.percentile(errors, 97) < 1e-6


def test_a_painted_point_off_the_bones_axis(within: Callable) -> None:
    chain = INDEX._replace(tool=np.array([0.002, -0.003, -0.012]))
    rng = np.random.default_rng(7)
    for _ in range(200):
        q = np.zeros(4)
        _, left, _ = analytic.solve(
            chain, tip_position(chain, within(rng, chain.limits, True)), q, 1e-6
        )
        assert left <= 1e-9


def test_nearest_of_the_coupled_family_elsewhere(within: Callable) -> None:
    """Never worse than damped least squares held to the same family by a heavy coupling."""
    stiff = INDEX._replace(coupling=np.array([2.0 / 3.0, 1e4]))
    rng, worse = np.random.default_rng(8), 0
    for _ in range(200):
        point = tip_position(INDEX, within(rng, INDEX.limits, False))
        q, other = np.zeros(4), np.array([0.0, 0.6, 0.7, 0.45])
        _, left, _ = analytic.solve(INDEX, point, q, 1e-6)
        assert q[3] == pytest.approx(min(2.0 / 3.0 * q[2], INDEX.limits[3, 1]))
        _, theirs, _ = dls.solve(stiff, tip_goal(COUPLED, point), other, 60, 1e-6)
        worse += left > theirs + 1e-4
    assert worse <= 4


def test_out_of_reach() -> None:
    q = np.zeros(4)
    _, left, state = analytic.solve(INDEX, np.array([0.0, -0.3, -0.4]), q, 1e-4)
    assert state == UNREACHABLE
    assert left == pytest.approx(0.5 - max_reach(INDEX), abs=1e-6)
    np.testing.assert_allclose(q, [0.0, np.arctan2(0.3, 0.4), 0.0, 0.0], atol=1e-6)


wild = st.one_of(st.floats(allow_nan=True, allow_infinity=True, width=64), st.floats(-0.1, 0.1))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(wild, min_size=3, max_size=3),
    st.lists(wild, min_size=4, max_size=4),
    st.lists(st.sampled_from([0.0, 1e-12, 0.02, 0.05]), min_size=3, max_size=3),
)
def test_nothing_leaves_the_limits(
    point: list[float], start: list[float], bones: list[float]
) -> None:
    # Alike in test_dls.py: every method makes the same promise.
    chain = INDEX._replace(lengths=np.array(bones), tool=np.array([0.0, 0.0, -bones[2]]))
    q = np.array(start)
    used, left, _ = analytic.solve(chain, np.array(point), q, 1e-4)
    assert np.all(q >= chain.limits[:, 0])
    assert np.all(q <= chain.limits[:, 1])
    assert used <= 120
    assert not np.isnan(left)
