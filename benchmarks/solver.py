"""How exact and how fast the solver is, beside its peers: `python benchmarks/solver.py [--json
FILE] [--quick]`.

Keys, with the figure that is wanted:
  dls_first_it <= 10, dls_later_it <= 5, dls_branch = 200, dls_tip_mm <= 1e-6   200 random grasps from the study's q0, tip pose as goal
  coupled_first_it, coupled_later_it                                            the same from position and coupling
  paper_first_it (33), paper_later_it (3-10)                                    the study's own algorithm: median of first frames, 10-90 %
  dls_reach >= .999, fabrik_reach >= .995, fabrik_alone, fabrik_turn_rad <= 1e-6, violations = 0   random reachable goals, every digit
  finger_us <= 5, five_us <= 15, hand_us <= 250, step_us                        medians, one process; step_us is points in, message out
  start_s <= 1                                                                  imports and kernels from a warm cache, in a new process
  peer_ratio >= 5, peers_us, peers_skipped                                      fastest peer that keeps limits / ours at the same accuracy
  flexion_deg <= 5.5, orientation_deg <= 4.5, *_knuckle_deg <= 2.3, 1.7          simulated hands, 1 mm of noise on wrist and tips
Peers that are not installed are skipped and named with the reason (solver_peers.py); without any,
peer_ratio is missing.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import solver_peers
from solver_hands import Motion, anywhere, grasp, messages, moving

from rhot.files.config import RigConfig
from rhot.geometry.transforms import angle_between, rotation_from_quaternion
from rhot.hand import BASIC_LANDMARKS, HANDS, HandModel, default_hand
from services.solver.finger import dls, dls_paper, fabrik
from services.solver.finger.swing_limits import BOX
from services.solver.maths import kinematics as k
from services.solver.step import SolverStep
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.point_check import places, usable

MODEL = default_hand()
CHAINS = k.hand_chains(MODEL)
INDEX = k.chain_of(CHAINS, 1)
FIRST = (0.0, np.pi / 2, 0.0, 0.0)
# 1e-6 mm is where `solve` ends when it is asked for a hundred times that.
EXACT_M = 1e-7


def grasps(count: int) -> dict[str, Any]:
    """Random 37-frame grasps from the study's start, half of them from a straight finger."""
    rng, first, later, tips, right = np.random.default_rng(1), [0], [0], [0.0], 0
    for number in range(count):
        chain, q, good = (
            INDEX._replace(lengths=INDEX.lengths * rng.uniform(0.8, 1.2)),
            np.array(FIRST),
            True,
        )
        for frame, angles in enumerate(grasp(rng, straight=number % 2 == 0)):
            used, left, _ = dls.solve_digit(
                chain, dls.goal(dls.POSE, *k.tip_reference(chain, angles)), q, 60, EXACT_M
            )
            (later if frame else first).append(used)
            tips.append(left)
            good &= bool(
                np.all(q >= chain.limits[:, 0])
                and np.all(q <= chain.limits[:, 1])
                and np.abs(q - angles).max() < 1e-2
            )
        right += good
    found = {
        "dls_first_it": max(first),
        "dls_later_it": max(later),
        "dls_branch": right,
        "dls_tip_mm": 1e3 * max(tips),
    }
    first, later = [0], [0]
    for number in range(count):
        q = np.array(FIRST)
        for frame, angles in enumerate(grasp(rng, number % 2 == 0, True)):
            used, _, _ = dls.solve_digit(
                INDEX, dls.goal(dls.COUPLED, k.tip(INDEX, angles)), q, 60, EXACT_M
            )
            (later if frame else first).append(used)
    return {**found, "coupled_first_it": max(first), "coupled_later_it": max(later)}


def paper(count: int) -> dict[str, Any]:
    """The study's algorithm under the reading of dls_paper.py, on grasps that start slightly bent."""
    rng, first, later = np.random.default_rng(2), [], []
    for _ in range(count):
        q = np.array(dls_paper.FIRST)
        for frame, angles in enumerate(grasp(rng)):
            end = dls_paper.solve(INDEX, *k.tip_reference(INDEX, angles), q, dls_paper.Reading())
            q = end.angles_rad
            (later if frame else first).append(end.iterations)
    share = np.percentile(later, [10, 90]).tolist()
    return {
        "paper_first_it": [min(first), float(np.median(first)), max(first)],
        "paper_later_it": share,
    }


def reach(count: int) -> dict[str, Any]:
    """Random reachable goals with coupling, every digit, from anywhere within the limits, to 0.1
    mm.
    """
    rng, solved, alone, all_of, violations = (
        np.random.default_rng(3),
        {"dls": 0, "fabrik": 0},
        0,
        0,
        0,
    )
    for number in range(count):
        chain = k.chain_of(CHAINS, number % 5)
        point, start = k.tip(chain, anywhere(rng, chain, True)), anywhere(rng, chain, False)
        a, b, c = start.copy(), start.copy(), start.copy()
        solved["dls"] += (
            dls.solve_digit(chain, dls.goal(dls.COUPLED, point), a, 60, 1e-4)[1] <= 1e-4
        )
        solved["fabrik"] += fabrik.solve(chain, point, b, BOX, 1000, 1e-4)[1] <= 1e-4
        alone += fabrik.reach(chain, point, c, BOX, 1000, 1e-4)[1] <= 1e-4
        violations += sum(
            bool(np.any(q < chain.limits[:, 0]) or np.any(q > chain.limits[:, 1]))
            for q in (a, b, c)
        )
        all_of += 1
    return {
        "dls_reach": solved["dls"] / all_of,
        "fabrik_reach": solved["fabrik"] / all_of,
        "fabrik_alone": alone / all_of,
        "fabrik_turn_rad": _turned(rng),
        "violations": violations,
    }


def _turned(rng: np.random.Generator) -> float:
    """The most that an angle differs between 100 turned worlds, over 20 goals."""
    worst = 0.0
    for _ in range(20):
        start = anywhere(rng, INDEX, False)
        point = CHAINS.base_m[1] + CHAINS.base_rotation[1] @ k.tip(
            INDEX, anywhere(rng, INDEX, True)
        )
        results = []
        for _ in range(100):
            R, t, q = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3), start.copy()
            there = k.to_canonical(
                R @ CHAINS.base_m[1] + t, R @ CHAINS.base_rotation[1], 1.0, R @ point + t
            )
            fabrik.solve(INDEX, there, q, BOX, 1000, 1e-4)
            results.append(q)
        worst = max(worst, float(np.ptp(results, axis=0).max()))
    return worst


def _median_us(calls: list[Callable[[], Any]], rounds: int) -> float:
    """Median time of the calls, run in order, `rounds` times over."""
    times = []
    for _ in range(rounds):
        for call in calls:
            began = time.perf_counter_ns()
            call()
            times.append(time.perf_counter_ns() - began)
    return float(np.median(times)) * 1e-3


def speed(rounds: int) -> dict[str, Any]:
    """One finger and five following a grasp, position and coupling; the whole hand followed.

    And the step around it.
    """
    frames = grasp(np.random.default_rng(4), coupled=True)
    frames = np.concatenate([frames, frames[::-1]])
    q, goals = frames[0].copy(), [dls.goal(dls.COUPLED, k.tip(INDEX, angles)) for angles in frames]
    finger = _median_us(
        [lambda g=goal: dls.solve_digit(INDEX, g, q, 60, 1e-4) for goal in goals], rounds
    )  # type: ignore[misc]
    hands = [
        np.clip(np.tile(angles, (5, 1)), MODEL.limits_rad[..., 0], MODEL.limits_rad[..., 1])
        for angles in frames
    ]
    tips = [
        np.array(
            [
                CHAINS.base_m[r] + CHAINS.base_rotation[r] @ k.tip(k.chain_of(CHAINS, r), h[r])
                for r in range(5)
            ]
        )
        for h in hands
    ]
    angles, seen, ends, keep = hands[0].copy(), np.ones(5, np.int64), np.empty((5, 3)), np.zeros(5)
    five = _median_us(
        [lambda p=p: dls.solve_digits(CHAINS, p, angles, keep, 60, 1e-4, seen, ends) for p in tips],
        rounds,
    )  # type: ignore[misc]
    motion = moving(MODEL, np.random.default_rng(5), "random")
    lines = messages(MODEL, motion, BASIC_LANDMARKS, np.random.default_rng(6), 1e-3)
    known = places(MODEL)
    tracker, step = HandTracker(MODEL, known), SolverStep(RigConfig(), {"right": MODEL})
    screened = [(line.stamp_ns, usable(line, known)) for line in lines]
    hand = _median_us([lambda s=s: tracker.look(*s) for s in screened], 3)  # type: ignore[misc]
    whole = _median_us([lambda line=line: step.step(line) for line in lines], 3)  # type: ignore[misc]
    return {"finger_us": finger, "five_us": five, "hand_us": hand, "step_us": whole}


def start_up() -> dict[str, Any]:
    """Seconds from nothing to the first pose in a new process, once the cache is warm: the least of
    five.
    """
    code = (
        "import time; began = time.perf_counter()\n"
        "from rhot.files.config import RigConfig\nfrom rhot.hand import default_hand\nfrom services.solver.warm import warm_up\n"
        "warm_up(RigConfig(), {'right': default_hand()}); print(time.perf_counter() - began)"
    )
    # The first run fills the cache where it was cold.
    runs = [
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(6)
    ]
    return {"start_s": min(float(seconds) for seconds in runs[1:])}


def beside_peers(rounds: int) -> dict[str, Any]:
    """The same grasp, there and back, tip pose, to 1e-6 mm, every solver in turn in this process.

    Ours again beside each peer.
    """
    chain = INDEX._replace(tool=np.array([0.0, 0.0, -INDEX.lengths[2]]))
    frames = grasp(np.random.default_rng(7))
    poses = [k.tip_reference(chain, angles) for angles in np.concatenate([frames, frames[::-1]])]
    q, goals = frames[0].copy(), [dls.goal(dls.POSE, *pose) for pose in poses]
    calls = [lambda g=goal: dls.solve_digit(chain, g, q, 60, EXACT_M) for goal in goals]  # type: ignore[misc]
    calls[0]()
    ours, table, ratios = [_median_us(calls, rounds)], {}, []
    installed, skipped = solver_peers.peers(chain)
    for name, solve in installed.items():
        ends = [solve(*pose) for pose in poses]
        keeps = all(
            bool(np.all(e >= chain.limits[:, 0] - 1e-9) and np.all(e <= chain.limits[:, 1] + 1e-9))
            for e in ends
        )
        theirs = [lambda p=pose, s=solve: s(*p) for pose in poses]  # type: ignore[misc]
        # Slow peers take seconds a round; their median is as steady after three.
        few = max(3, min(rounds, int(2e4 / _median_us(theirs, 1))))
        table[name] = _median_us(theirs, few)
        ours.append(_median_us(calls, rounds))
        if keeps and name not in solver_peers.WITHOUT_LIMITS:
            ratios.append(table[name] / ours[-1])
    found: dict[str, Any] = {
        "ours_us": float(np.median(ours)),
        "peers_us": table,
        "peers_skipped": skipped,
    }
    return {**found, "peer_ratio": min(ratios)} if ratios else found


def accuracy(seeds: int) -> dict[str, Any]:
    """With wrist and tips alone, and with the middle knuckle painted."""
    found: dict[str, Any] = {}
    for suffix, extra in (("", ()), ("_knuckle", ("middle_proximal",))):
        flexion, turn, thumb, abduction = with_painted(extra, seeds)
        found |= {f"flexion{suffix}_deg": flexion, f"orientation{suffix}_deg": turn}
        found |= {f"thumb{suffix}_deg": thumb, f"abduction{suffix}_deg": abduction}
    return found


def with_painted(extra: Sequence[str], seeds: int) -> tuple[float, float, float, float]:
    """Mean errors over random motions and fists, right and left hands, 1 mm of noise.

    Extra: painted beside wrist and tips.
    """
    rows = []
    for seed, kind, hand in itertools.product(range(seeds), ("random", "fist"), HANDS):
        model, rng = (
            default_hand(hand),
            np.random.default_rng([seed, kind == "fist", hand == "left"]),
        )
        rows.append(errors_of(model, moving(model, rng, kind), (*BASIC_LANDMARKS, *extra), rng))
    flexion, turn, thumb, abduction = np.mean(rows, axis=0).tolist()
    return flexion, turn, thumb, abduction


def errors_of(
    model: HandModel,
    motion: Motion,
    names: Sequence[str],
    rng: np.random.Generator,
    painted: HandModel | None = None,
) -> tuple[float, float, float, float]:
    """Mean errors of one motion in degrees: flexion of the fingers, orientation, thumb, abduction
    of the fingers.

    painted: the hand as it is, where it differs from the model of it. The first 5 frames are left
    out.
    """
    step, rows = SolverStep(RigConfig(), {model.hand: model}), []
    for frame, line in enumerate(messages(painted or model, motion, names, rng, 1e-3)):
        pose = step.step(line)
        if pose is not None and frame >= 5:
            off = np.abs(
                np.array([f.model_angles_rad for f in pose.fingers]) - motion.angles_rad[frame]
            )
            turn = angle_between(
                rotation_from_quaternion(pose.wrist.orientation_wxyz), motion.rotations[frame]
            )
            rows.append((off[1:, 1:].mean(), turn, off[0].mean(), off[[1, 3, 4], 0].mean()))
    flexion, turn, thumb, abduction = np.rad2deg(np.mean(rows, axis=0)).tolist()
    return flexion, turn, thumb, abduction


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument(
        "--quick", action="store_true", help="a tenth of the work: for a look, not for figures"
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
