"""How exact and how fast the solver is, beside its peers.

`python benchmarks/solver.py [--json FILE] [--quick]`. Keys, with the figure that is wanted:
200 random grasps from the study's q0, tip pose as goal:
  dls_first_it <= 10, dls_later_it <= 5, dls_branch = 200, dls_tip_mm <= 1e-6
the same from position and coupling:
  coupled_first_it, coupled_later_it
the study's own algorithm, median of first frames, 10-90 % of later ones:
  paper_first_it (33), paper_later_it (3-10)
random reachable goals, every digit:
  dls_reach >= .999, fabrik_reach >= .995, fabrik_alone, fabrik_turn_rad <= 1e-6, violations = 0
medians, one process (step_us is points in, message out):
  finger_us <= 5, five_us <= 15, hand_us <= 250, step_us
imports and kernels from a warm cache, in a new process:
  start_s <= 1
fastest peer that keeps limits / ours at the same accuracy:
  peer_ratio >= 5, peers_us, peers_skipped
simulated hands, 1 mm of noise on wrist and tips:
  flexion_deg <= 5.5, orientation_deg <= 4.5, *_knuckle_deg <= 2.3, 1.7
Peers that are not installed are skipped and named with the reason (solver_peers.py); without any,
peer_ratio is missing.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from solver_hands import CHAINS, INDEX, anywhere, grasp, tip_pose, with_painted
from solver_speed import EXACT_M, beside_peers, speed, start_up

from rhot.geometry.transforms import Array, rotation_from_quaternion
from services.solver.finger import dls, dls_paper, fabrik
from services.solver.finger.dls_equations import COUPLED, POSE, tip_goal
from services.solver.finger.swing_limits import BOX
from services.solver.maths.chains import Chain, canonical_from_wrist, digit_chain
from services.solver.maths.kinematics import tip_position

# Where the study starts: the knuckle bent by a right angle.
FIRST = (0.0, np.pi / 2, 0.0, 0.0)


def grasps(count: int) -> dict[str, Any]:
    """Random 37-frame grasps from the study's start, half of them from a straight finger."""
    rng = np.random.default_rng(1)
    return {**_grasps_by_pose(rng, count), **_grasps_by_coupling(rng, count)}


def _grasps_by_pose(rng: np.random.Generator, count: int) -> dict[str, Any]:
    """Goal: the tip's position and orientation."""
    first, later, tips, right = [0], [0], [0.0], 0
    for number in range(count):
        chain = INDEX._replace(lengths=INDEX.lengths * rng.uniform(0.8, 1.2))
        q, good = np.array(FIRST), True
        for frame, angles in enumerate(grasp(rng, straight=number % 2 == 0)):
            goal = tip_goal(POSE, *tip_pose(chain, angles))
            used, left, _ = dls.solve_digit(chain, goal, q, 60, EXACT_M)
            (later if frame else first).append(used)
            tips.append(left)
            good &= _is_within(q, chain) and bool(np.abs(q - angles).max() < 1e-2)
        right += good
    return {
        "dls_first_it": max(first),
        "dls_later_it": max(later),
        "dls_branch": right,
        "dls_tip_mm": 1e3 * max(tips),
    }


def _grasps_by_coupling(rng: np.random.Generator, count: int) -> dict[str, Any]:
    """Goal: the tip's position, and DIP = 2/3 PIP."""
    first, later = [0], [0]
    for number in range(count):
        q = np.array(FIRST)
        for frame, angles in enumerate(grasp(rng, number % 2 == 0, True)):
            goal = tip_goal(COUPLED, tip_position(INDEX, angles))
            used, _, _ = dls.solve_digit(INDEX, goal, q, 60, EXACT_M)
            (later if frame else first).append(used)
    return {"coupled_first_it": max(first), "coupled_later_it": max(later)}


def paper(count: int) -> dict[str, Any]:
    """The study's algorithm as dls_paper.py reads it, on grasps that start slightly bent."""
    rng, first, later = np.random.default_rng(2), [], []
    for _ in range(count):
        q = np.array(dls_paper.INITIAL_ANGLES_RAD)
        for frame, angles in enumerate(grasp(rng)):
            end = dls_paper.solve(INDEX, *tip_pose(INDEX, angles), q, dls_paper.Options())
            q = end.angles_rad
            (later if frame else first).append(end.iterations)
    share = np.percentile(later, [10, 90]).tolist()
    return {
        "paper_first_it": [min(first), float(np.median(first)), max(first)],
        "paper_later_it": share,
    }


def reach(count: int) -> dict[str, Any]:
    """Random reachable goals with coupling, every digit, from anywhere within limits, to 0.1 mm."""
    rng = np.random.default_rng(3)
    by_dls, by_fabrik, by_fabrik_alone, violations = 0, 0, 0, 0
    for number in range(count):
        chain = digit_chain(CHAINS, number % 5)
        point, start = tip_position(chain, anywhere(rng, chain, True)), anywhere(rng, chain, False)
        a, b, c = start.copy(), start.copy(), start.copy()
        goal = tip_goal(COUPLED, point)
        by_dls += dls.solve_digit(chain, goal, a, 60, 1e-4)[1] <= 1e-4
        by_fabrik += fabrik.solve(chain, point, b, BOX, 1000, 1e-4)[1] <= 1e-4
        by_fabrik_alone += fabrik.reach(chain, point, c, BOX, 1000, 1e-4)[1] <= 1e-4
        violations += sum(not _is_within(q, chain) for q in (a, b, c))
    return {
        "dls_reach": by_dls / count,
        "fabrik_reach": by_fabrik / count,
        "fabrik_alone": by_fabrik_alone / count,
        "fabrik_turn_rad": _turned(rng),
        "violations": violations,
    }


def _is_within(q: Array, chain: Chain) -> bool:
    """Whether all angles (4,) are within the limits."""
    return bool(np.all(q >= chain.limits[:, 0]) and np.all(q <= chain.limits[:, 1]))


def _turned(rng: np.random.Generator) -> float:
    """The most that an angle differs between 100 turned worlds, over 20 goals."""
    worst, base, axes = 0.0, CHAINS.base_m[1], CHAINS.base_rotation[1]
    for _ in range(20):
        start = anywhere(rng, INDEX, False)
        point = base + axes @ tip_position(INDEX, anywhere(rng, INDEX, True))
        results = []
        for _ in range(100):
            R, t, q = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3), start.copy()
            target = canonical_from_wrist(R @ base + t, R @ axes, 1.0, R @ point + t)
            fabrik.solve(INDEX, target, q, BOX, 1000, 1e-4)
            results.append(q)
        worst = max(worst, float(np.ptp(results, axis=0).max()))
    return worst


def accuracy(seeds: int) -> dict[str, Any]:
    """With wrist and tips alone, and with the middle knuckle painted."""
    found: dict[str, Any] = {}
    for suffix, extra in (("", ()), ("_knuckle", ("middle_proximal",))):
        flexion, turn, thumb, abduction = with_painted(extra, seeds)
        found |= {f"flexion{suffix}_deg": flexion, f"orientation{suffix}_deg": turn}
        found |= {f"thumb{suffix}_deg": thumb, f"abduction{suffix}_deg": abduction}
    return found


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument(
        "--quick", action="store_true", help="a tenth of the work: to try it, not for figures"
    )
    options = parser.parse_args()
    part = 10 if options.quick else 1
    found = (
        grasps(200 // part)
        | paper(50 // part)
        | reach(5000 // part)
        | speed(50 // part)
        | start_up()
        | beside_peers(50 // part)
    )
    found |= accuracy(max(10 // part, 2))
    for key, value in found.items():
        print(f"{key:24s} {json.dumps(value, default=float)}")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1, default=float) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
