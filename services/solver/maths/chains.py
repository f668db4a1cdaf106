"""A hand model as plain arrays for the compiled kernels: one kinematic chain per digit.

A digit is a serial chain of four hinges: abduction about y, then three flexions about -x, with the
bones along -z. Each digit is solved in its own *canonical frame*: origin in the chain's root, axes
of the first bone at zero angles, x mirrored for a left hand. The solvers of one digit therefore
know neither the world (a result cannot depend on how the hand is turned) nor left from right.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, HandModel

# Joints of each digit from the chain's root to its tip, as a constant that kernels can use; (5, 4).
CHAINS = CHAIN_JOINTS.astype(np.int64)


class Chain(NamedTuple):
    """One digit in its canonical frame.

    Any unit of length (the solvers scale it to 1).
    """

    lengths: Array  # (3,) bones
    # (3,) the painted point in the axes of the last joint: about (0, 0, -length of the last bone).
    tool: Array
    limits: Array  # (4, 2) low and high, rad
    coupling: Array  # (2,) ratio and weight of last flexion = ratio * second flexion


class HandChains(NamedTuple):
    """The five chains of a hand; metres, radians, rows in the order of DIGITS."""

    base_m: Array  # (5, 3) root of each chain in the wrist frame
    base_rotation: Array  # (5, 3, 3) axes of its first bone at zero angles, in the wrist frame
    metacarpal_m: Array  # (5, 3) start of the metacarpal, in the wrist frame
    lengths_m: Array  # (5, 3) bones
    tool_m: Array  # (5, 3) the painted point, as in Chain
    limits_rad: Array  # (5, 4, 2)
    coupling: Array  # (5, 2) as in Chain
    side: float  # +1 right hand, -1 left hand


def hand_chains(model: HandModel) -> HandChains:
    """The kernels' view of a person's hand.

    The tool is the tip's painted point (Paint.offset_m short of the tip).
    """
    tool = np.empty((5, 3))
    for row, digit in enumerate(model.digits):
        x, y, z = model.paint[f"{digit.name}_tip"].offset_m
        tool[row] = (model.side * x, y, z - digit.lengths_m[2])
    return HandChains(
        base_m=np.array([d.base_m for d in model.digits], dtype=np.float64),
        base_rotation=np.array([rotation_from_quaternion(d.base_wxyz) for d in model.digits]),
        metacarpal_m=np.array([d.metacarpal_m for d in model.digits], dtype=np.float64),
        lengths_m=np.array([d.lengths_m for d in model.digits], dtype=np.float64),
        tool_m=tool,
        limits_rad=np.array([d.limits_rad for d in model.digits], dtype=np.float64),
        coupling=np.array(
            [(d.coupling, d.coupling_weight) for d in model.digits], dtype=np.float64
        ),
        side=model.side,
    )


@njit(cache=True)
def resized(chains: HandChains, factor: float) -> HandChains:
    """A hand so many times as large; paint on tips is as long as it was."""
    tool_m = chains.tool_m.copy()
    tool_m[:, 2] -= (factor - 1.0) * chains.lengths_m[:, 2]
    return HandChains(
        chains.base_m * factor,
        chains.base_rotation,
        chains.metacarpal_m * factor,
        chains.lengths_m * factor,
        tool_m,
        chains.limits_rad,
        chains.coupling,
        chains.side,
    )


@njit(cache=True)
def digit_chain(chains: HandChains, row: int) -> Chain:
    """One digit of a hand, lengths in metres."""
    return Chain(
        chains.lengths_m[row], chains.tool_m[row], chains.limits_rad[row], chains.coupling[row]
    )


@njit(cache=True)
def max_reach(chain: Chain) -> float:
    """Distance from the root to the painted point of a straight digit.

    As if the point were on the bone's axis.
    """
    tool = chain.tool
    return (
        chain.lengths[0] + chain.lengths[1] + math.sqrt(tool[0] ** 2 + tool[1] ** 2 + tool[2] ** 2)
    )


@njit(cache=True)
def scale_chain(chain: Chain, factor: float) -> Chain:
    """The same digit in another unit of length."""
    return Chain(chain.lengths * factor, chain.tool * factor, chain.limits, chain.coupling)


@njit(cache=True)
def norm(v: Array) -> float:
    """Euclidean length of v (3,)."""
    return math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)


@njit(cache=True)
def canonical_from_wrist(base_m: Array, base_rotation: Array, side: float, p_wrist: Array) -> Array:
    """A point of the wrist frame in a chain's canonical frame; (3,) -> (3,)."""
    dx = p_wrist[0] - base_m[0]
    dy = p_wrist[1] - base_m[1]
    dz = p_wrist[2] - base_m[2]
    p_canonical = np.empty(3)
    for i in range(3):
        p_canonical[i] = (
            base_rotation[0, i] * dx + base_rotation[1, i] * dy + base_rotation[2, i] * dz
        )
    p_canonical[0] *= side
    return p_canonical
