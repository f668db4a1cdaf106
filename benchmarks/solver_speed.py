"""Times for benchmarks/solver.py: one finger, a hand, the step around it, the start, the peers."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import solver_peers
from solver_hands import CHAINS, INDEX, MODEL, grasp, messages, moving, tip_pose

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from services.solver.finger import dls
from services.solver.finger.dls_equations import COUPLED, POSE, tip_goal
from services.solver.maths.chains import digit_chain
from services.solver.maths.kinematics import tip_position
from services.solver.step import SolverStep
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.landmarks import hand_landmarks
from services.solver.whole_hand.point_check import usable_points

# 1e-6 mm is where `solve` ends when it is asked for a hundred times that.
EXACT_M = 1e-7


def speed(rounds: int) -> dict[str, Any]:
    """Medians in us: one finger and five following a grasp, the whole hand, the step around it.

    The fingers from position and coupling.
    """
    frames = grasp(np.random.default_rng(4), coupled=True)
    frames = np.concatenate([frames, frames[::-1]])
    return {
        "finger_us": _finger_us(frames, rounds),
        "five_us": _five_us(frames, rounds),
        **_hand_us(),
    }


def start_up() -> dict[str, Any]:
    """Seconds from nothing to the first pose in a new process with a warm cache: least of five."""
    code = (
        "import time; began = time.perf_counter()\n"
        "from rhot.files.config import RigConfig\nfrom rhot.hand import default_hand\n"
        "from services.solver.warm import warm_up\n"
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
    poses = [tip_pose(chain, angles) for angles in np.concatenate([frames, frames[::-1]])]
    q, goals = frames[0].copy(), [tip_goal(POSE, *pose) for pose in poses]
    calls = [partial(dls.solve_digit, chain, goal, q, 60, EXACT_M) for goal in goals]
    calls[0]()
    ours, table, ratios = [_median_us(calls, rounds)], {}, []
    installed, skipped = solver_peers.peers(chain)
    for name, solve in installed.items():
        ends = [solve(*pose) for pose in poses]
        keeps = all(
            bool(np.all(e >= chain.limits[:, 0] - 1e-9) and np.all(e <= chain.limits[:, 1] + 1e-9))
            for e in ends
        )
        theirs = [partial(solve, *pose) for pose in poses]
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


def _median_us(calls: list[Callable[[], Any]], rounds: int) -> float:
    """Median time of the calls, run in order, `rounds` times over."""
    times = []
    for _ in range(rounds):
        for call in calls:
            start_ns = time.perf_counter_ns()
            call()
            times.append(time.perf_counter_ns() - start_ns)
    return float(np.median(times)) * 1e-3


def _finger_us(frames: Array, rounds: int) -> float:
    """The index finger along frames (n, 4)."""
    q = frames[0].copy()
    goals = [tip_goal(COUPLED, tip_position(INDEX, angles)) for angles in frames]
    return _median_us(
        [partial(dls.solve_digit, INDEX, goal, q, 60, 1e-4) for goal in goals], rounds
    )


def _five_us(frames: Array, rounds: int) -> float:
    """All digits at once along frames (n, 4)."""
    limits = MODEL.limits_rad
    hands = [np.clip(np.tile(q, (5, 1)), limits[..., 0], limits[..., 1]) for q in frames]
    angles, ends = hands[0].copy(), np.empty((5, 3))
    calls = []
    for hand in hands:
        tips = [tip_position(digit_chain(CHAINS, row), hand[row]) for row in range(5)]
        points = CHAINS.base_m + np.einsum("rij,rj->ri", CHAINS.base_rotation, tips)
        targets = dls.TipTargets(points, np.ones(5, np.int64), np.zeros(5))
        calls.append(partial(dls.solve_digits, CHAINS, targets, angles, 60, 1e-4, ends))
    return _median_us(calls, rounds)


def _hand_us() -> dict[str, float]:
    """The tracker of a whole hand, and the step around it."""
    motion = moving(MODEL, np.random.default_rng(5), "random")
    lines = messages(MODEL, motion, BASIC_LANDMARKS, np.random.default_rng(6), 1e-3)
    landmarks = hand_landmarks(MODEL)
    tracker, step = HandTracker(MODEL, landmarks), SolverStep(RigConfig(), {"right": MODEL})
    observed = [(line.stamp_ns, usable_points(line, landmarks)) for line in lines]
    return {
        "hand_us": _median_us([partial(tracker.track, *s) for s in observed], 3),
        "step_us": _median_us([partial(step.step, line) for line in lines], 3),
    }
