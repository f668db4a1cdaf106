"""Damped least squares as the index-finger study implements it, for comparison.

Chatterjee et al., "Trajectory based Recovery of Index Finger Articulated Pose during Palmar Grasp",
section 3 and appendix A1, A3. The product's own is dls.py.

Each step is dq = J^T [J J^T + diag(l1..l4, .7, .7)^2]^-1 e, with e = (position, orientation) of the
tip and the damping of eq. (1), l_i = eta [(2 q_i - max_i - min_i) / (max_i - min_i)]^p, eta = 1, p
= 6, which grows as a joint nears its limit. Each frame starts from the last one's angles, the first
from q = [0, pi/2, 0, 0]; a frame ends when |dq| < 1e-6. The study's D-H rows are our chain with its
axes renamed (kinematics.tip_jacobian), so its kinematics are not repeated here.

Where the print is inconsistent, and what is done here:
- A3 prints J^T [J^T J + l^2 I]^-1, a (4x6)(4x4) product that does not conform. "A 6x6 diagonal
  matrix" in the text can only damp J J^T, so that is the reading.
- A3 prints the filter s / (s + l^2); the text and the pseudo-code have s / (s^2 + l^2). The printed
  one diverges. The SVD form uses the latter with l_i for the i-th singular value, "a fixed .7" for
  those beyond the fourth.
- Damping four of six task coordinates with four joints' factors pairs x with abduction, y with MCP
  flexion ...; taken as printed.
- Lengths are pixels there; here millimetres. In metres the damping dwarfs J J^T and it stalls.
- Nothing keeps q in its range but the damping. Taken so, from that start, the finger ends on the
  mirror elbow (PIP < 0) or winds up in every grasp, so `clip=True` brings q into the limits after
  each step. Then 60 random grasps that start from a slightly bent finger take 15-33 iterations in
  the first frame (SVD form: 18-35; the study: 33) and 3-7 in nine of ten later ones (the study:
  3-10); frames at a dead straight finger, where three joints stand at their limits, take up to 100.
- DLS-1 aims at the forward kinematics of measured angles, DLS-2 at the measured tip. With one
  painted point there is no measured orientation: the live solver aims at the whole-hand solution's.
Input that is not finite leaves the angles alone, as NOT_CONVERGED.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.geometry.transforms import Array
from services.solver.finger.outcome import NOT_CONVERGED, SOLVED, UNREACHABLE
from services.solver.maths.chains import Chain
from services.solver.maths.joint_limits import clamp_to_limits
from services.solver.maths.kinematics import tip_jacobian, tip_position, tip_rotation

# The study's constants: eta and p of eq. (1), "a fixed value of l5 = l6 = 0.7", tolerance 1E-06,
# first posture.
ETA, POWER, FIXED_DAMPING, MIN_STEP_RAD = 1.0, 6, 0.7, 1e-6
INITIAL_ANGLES_RAD = (0.0, np.pi / 2, 0.0, 0.0)
_MM_PER_M = 1e3

Form = Literal["normal", "svd"]


@dataclass(frozen=True)
class Options:
    """How the print is read, and when to give up."""

    form: Form = "normal"  # normal equations or SVD
    clip: bool = True  # bring the angles into the limits after each step
    max_iterations: int = 200
    tolerance_m: float = 1e-4


@dataclass(frozen=True)
class Solution:
    """One frame's end."""

    angles_rad: Array  # (4,)
    iterations: int
    residual_m: float  # distance left
    outcome: int  # SOLVED | UNREACHABLE | NOT_CONVERGED


def solve(chain: Chain, point: Array, rotation: Array, q0: Array, options: Options) -> Solution:
    """One frame: tip to point (3,), metres, and last bone to rotation (3, 3).

    Canonical frame; starts from q0 (4,) (feed-forward).
    """
    limits = chain.limits
    q = np.array(q0, dtype=np.float64)
    if options.clip or not np.all(np.isfinite(q)):
        clamp_to_limits(q, limits)
    # A target that far cannot be squared in double precision, and no hand is a kilometre wide; a
    # rotation's elements are within 1.
    if not (np.all(np.abs(point) < 1e3) and np.all(np.abs(rotation) < 2.0)):
        return Solution(q, 0, 0.0, NOT_CONVERGED)
    p, J = np.empty(3), np.empty((6, 4))
    used, moved = 0, np.inf
    while used < options.max_iterations and moved >= MIN_STEP_RAD:
        used += 1
        tip_jacobian(chain, q, p, J)
        J[:3] *= _MM_PER_M
        e = pose_error(p, tip_rotation(q), point, rotation)
        new = q + step(J, e, damping(q, limits), options.form)
        # Without clipping, angles that wind up have a damping beyond all numbers.
        if not np.all(np.isfinite(new)):
            break
        if options.clip:
            new = np.clip(new, limits[:, 0], limits[:, 1])
        moved, q = float(np.linalg.norm(new - q)), new
    residual = float(np.linalg.norm(tip_position(chain, q) - point))
    if residual <= options.tolerance_m:
        return Solution(q, used, residual, SOLVED)
    gave_up = used == options.max_iterations
    return Solution(q, used, residual, NOT_CONVERGED if gave_up else UNREACHABLE)


def damping(q: Array, limits: Array) -> Array:
    """Eq. (1) of the study for the four joints and the fixed .7 twice; (4,), (4, 2) -> (6,)."""
    span = limits[:, 1] - limits[:, 0]
    # A joint without range (the middle finger's abduction) has no limit to avoid.
    share = np.divide(
        2.0 * q - limits[:, 1] - limits[:, 0], span, out=np.zeros(4), where=span > 0.0
    )
    return np.append(ETA * share**POWER, (FIXED_DAMPING, FIXED_DAMPING))


def pose_error(p: Array, R: Array, goal: Array, goal_R: Array) -> Array:
    """de of A3, (6,): position in mm, half the sum of the axes' cross products (rad near 0)."""
    turn = 0.5 * sum(np.cross(R[:, k], goal_R[:, k]) for k in range(3))
    return np.concatenate([_MM_PER_M * (goal - p), turn])


def step(J: Array, e: Array, factors: Array, form: Form) -> Array:
    """One dq (4,) from J (6, 4) with lengths in mm, e (6,) and damping factors (6,).

    Not a number where those have overflowed.
    """
    if not np.all(np.isfinite(factors)):
        return np.full(4, np.nan)
    if form == "normal":
        return J.T @ np.linalg.solve(J @ J.T + np.diag(factors**2), e)
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    gain = np.divide(sigma, sigma**2 + factors[:4] ** 2, out=np.zeros(4), where=sigma > 1e-12)
    return Vt.T @ (gain * (U.T @ e))
