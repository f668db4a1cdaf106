"""The closed form for any law: with 2/3 PIP it is the solver's."""

from __future__ import annotations

import numpy as np
import pytest

from services.solver.finger import analytic
from services.solver.finger.outcome import SOLVED, UNREACHABLE
from studies.grasp.planar import TWO_THIRDS, canonical, chain_of, joints_of, limits_of
from studies.grasp.recover.closed_form import solve_with_law
from studies.grasp.recover.laws import Law

LENGTHS = np.array([45.0, 25.0, 19.0])
LIMITS = limits_of("index", {})
RANGE = (0.0, np.deg2rad(120.0))


def tip(mcp_deg: float, pip_deg: float, law: Law) -> tuple[np.ndarray, np.ndarray]:
    pip = np.deg2rad(pip_deg)
    angles = np.array([np.deg2rad(mcp_deg), pip, float(law.dip(np.array([pip]))[0])])
    return angles, joints_of(angles[None], LENGTHS)[0, 3]


@pytest.mark.parametrize("coefficients", [(0.0, TWO_THIRDS, 0.0), (0.04, 0.15, 0.36)])
def test_it_returns_the_angles_that_made_the_tip(coefficients):
    law = Law(coefficients, RANGE)
    start = np.zeros(3)
    for mcp, pip in ((-20.0, 5.0), (0.0, 30.0), (40.0, 80.0), (85.0, 105.0)):
        angles, point = tip(mcp, pip, law)
        found, used, left, outcome = solve_with_law(LENGTHS, LIMITS, law, point, start, 1e-3)
        assert outcome == SOLVED
        assert found == pytest.approx(angles, abs=1e-5)
        assert left < 1e-4
        assert used > 0
        start = found


def test_with_two_thirds_it_agrees_with_the_solver():
    law = Law((0.0, TWO_THIRDS, 0.0), RANGE)
    rng = np.random.default_rng(4)
    for _ in range(20):
        _, point = tip(rng.uniform(-30, 90), rng.uniform(10, 115), law)
        q = np.zeros(4)
        analytic.solve(chain_of(LENGTHS, LIMITS), canonical(point), q, 1e-3)
        found = solve_with_law(LENGTHS, LIMITS, law, point, q[1:], 1e-3)[0]
        assert found == pytest.approx(q[1:], abs=1e-4)


@pytest.mark.parametrize("point", [(200.0, 0.0), (-60.0, -60.0), (1.0, 1.0)])
def test_out_of_reach_gives_the_nearest_within_limits(point):
    law = Law((0.0, TWO_THIRDS, 0.0), RANGE)
    found, _, left, outcome = solve_with_law(
        LENGTHS, LIMITS, law, np.array(point), np.zeros(3), 0.01
    )
    assert outcome == UNREACHABLE
    assert ((found >= LIMITS[1:, 0]) & (found <= LIMITS[1:, 1])).all()
    pips = np.linspace(*LIMITS[2], 60)
    grid = np.array([(m, p, law.dip(p)) for m in np.linspace(*LIMITS[1], 60) for p in pips])
    gaps = joints_of(grid, LENGTHS)[:, 3] - point
    assert left <= np.hypot(gaps[:, 0], gaps[:, 1]).min() + 1e-6
