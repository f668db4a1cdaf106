"""Where to begin when nothing is known of a hand: which way it is turned, roughly how it is bent.

Some postures (open, relaxed, fist, point, pinch, ...) are laid onto the markers rigidly (Kabsch
1976, never mirrored), then turned about the line from wrist to finger tips and flipped, and each is
improved by whole_hand.fit; the cheapest wins. Wrist and tips lie nearly in a plane on an open hand,
so that one start alone can end with the palm on the wrong side: RHOT's markers cannot tell
otherwise than by the order of the fingers and the limits of their joints. Markers that are all in
one place give a pose with a large cost, no error.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from services.solver.maths.kinematics import Chains, hand_frames
from services.solver.whole_hand.fit import Marks, fit
from services.solver.whole_hand.motion_prior import UNKNOWNS, Belief

# Postures in degrees: flexions of fingers (MCP, PIP; DIP follows) and of the thumb (CMC, MCP, IP).
_POSTURES = (
    ((5.0, 10.0), (0.0, 10.0, 10.0)),
    ((30.0, 40.0), (5.0, 20.0, 20.0)),
    ((55.0, 75.0), (10.0, 30.0, 30.0)),
    ((80.0, 100.0), (20.0, 40.0, 50.0)),
    ((75.0, 15.0), (10.0, 20.0, 20.0)),
    ((10.0, 95.0), (10.0, 30.0, 40.0)),
)
# Turns about the line from the wrist to the tips, and half turns about the others: every start that
# could be a mirror image.
_TURNS = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, np.pi),
    (0.0, 0.0, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (np.pi, 0.0, 0.0),
    (0.0, np.pi, 0.0),
)
# Iterations to sort the starts, and to finish the best few.
_COARSE, _FINE, _KEPT = 6, 60, 4


def begin(chains: Chains, belief: Belief, marks: Marks) -> tuple[float, Array, Array, Array, Array]:
    """The best pose for markers when nothing is known of the wrist: cost, rotation (3, 3), position
    (3,), angles (5, 4), information.

    Deterministic; about 3 ms. The cost is a sum of squares in standard deviations.
    """
    found = []
    for angles in postures(chains):
        R0, t0 = _laid(chains, marks, angles)
        for turn in _TURNS:
            R, q, information = (
                R0 @ rotation_from_vector(turn),
                angles.copy(),
                np.empty((UNKNOWNS, UNKNOWNS)),
            )
            t = marks.point_m.mean(axis=0) - R @ R0.T @ (marks.point_m.mean(axis=0) - t0)
            cost, _ = fit(chains, marks, belief, R, t, q, _COARSE, information)
            found.append((cost, R, t, q, information))
    found.sort(key=lambda start: start[0])
    finished = []
    for _, R, t, q, information in found[:_KEPT]:
        cost, _ = fit(chains, marks, belief, R, t, q, _FINE, information)
        finished.append((cost, R, t, q, information))
    return min(finished, key=lambda start: start[0])


def postures(chains: Chains) -> list[Array]:
    """The postures to begin from, within a person's limits; each (5, 4) rad."""
    result = []
    for (mcp, pip), thumb in _POSTURES:
        angles = np.deg2rad(np.array([(5.0, *thumb), *((0.0, mcp, pip, 2.0 / 3.0 * pip),) * 4]))
        result.append(np.clip(angles, chains.limits_rad[:, :, 0], chains.limits_rad[:, :, 1]))
    return result


def _laid(chains: Chains, marks: Marks, angles: Array) -> tuple[Array, Array]:
    """Rotation and position that lay the posture's markers onto the measured ones (Kabsch 1976,
    weights 1).
    """
    positions, rotations = np.empty((26, 3)), np.empty((26, 3, 3))
    hand_frames(chains, np.eye(3), np.zeros(3), angles, positions, rotations)
    model = np.array(
        [
            o if d < 0 else positions[j] + rotations[j] @ o
            for j, d, o in zip(
                marks.joint.tolist(), marks.digit.tolist(), marks.offset_m, strict=True
            )
        ]
    )
    centre, seen = model.mean(axis=0), marks.point_m.mean(axis=0)
    U, _, Vt = np.linalg.svd((marks.point_m - seen).T @ (model - centre))
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    return R, seen - R @ centre
