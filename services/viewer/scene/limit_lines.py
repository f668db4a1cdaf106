"""Joint limits as lines about the joints of a pose: the paper's Figure 4. Pure.

A hinge has an arc, from as far back to as far on as its bone can turn. The root of a digit turns
two ways: its bone stays in a cone, whose rim is where it can go no further. Lines are made once, in
the frames that the limits are told in, and moved to the joints of each pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array, rotation_x, rotation_y
from rhot.hand import CHAIN_JOINTS, HandModel

# A solver that holds a limit holds it exactly; a hand whose joint is within this of it feels it.
REACHED_RAD = float(np.deg2rad(2.0))
# Of the bone's length: the arc is crossed by the bone itself, clear of the joint's ball and of the
# next arc.
_RADIUS = 0.55
# Lines along an arc, and along each of the four sides of a cone's rim.
_STEPS, _SIDE_STEPS = 12, 8
# Lines at an arc's end that light up with it: a sixth of the arc, seen at arm's length.
_LIT_STEPS = 2
_NOBODY = -1


class LimitLines(NamedTuple):
    """Lines (s, 2, 3) in the frame of the pose, and which of them mark a limit that is reached."""

    lines_m: Array
    reached: npt.NDArray[np.bool_]  # (s,)


class _Part(NamedTuple):
    """Lines of one joint about the origin, radius 1; ends: 2 * angle + (0 low, 1 high), or -1."""

    lines: Array  # (s, 2, 3)
    ends: npt.NDArray[np.int64]  # (s,)


class HandLimits:
    """The limits of one person's hand."""

    def __init__(self, model: HandModel) -> None:
        self._side = model.side
        self._limits_rad = model.limits_rad
        parts = [
            part for row in range(5) for part in _digit(self._limits_rad[row], row, model.side)
        ]
        self._lines = np.concatenate([part.lines for part in parts])
        self._ends = np.concatenate([part.ends for part in parts])
        # Which of the 15 joints, three a digit, a line belongs to.
        self._joint = np.repeat(np.arange(15), [len(part.lines) for part in parts])

    def lines(self, positions_m: Array, rotations: Array, angles_rad: Array) -> LimitLines:
        """Of a pose: joints (26, 3) and (26, 3, 3), angles (5, 4) as HandPose.angles_rad."""
        chain = positions_m[CHAIN_JOINTS]  # (5, 4, 3)
        frames = self._frames(rotations[CHAIN_JOINTS], angles_rad)
        radii = _RADIUS * np.linalg.norm(chain[:, 1:] - chain[:, :-1], axis=2).reshape(15)
        turned = np.einsum("sij,spj->spi", frames[self._joint], self._lines)
        apex = chain[:, :3].reshape(15, 3)
        lines_m = apex[self._joint, None] + radii[self._joint, None, None] * turned
        return LimitLines(lines_m, self.reached(angles_rad)[self._ends])

    def reached(self, angles_rad: Array) -> npt.NDArray[np.bool_]:
        """(41,) of each angle's low and high limit whether it is reached; the last is False.

        An angle that cannot move at all has no limit to reach.
        """
        off = np.abs(angles_rad[..., None] - self._limits_rad)  # (5, 4, 2)
        moves = self._limits_rad[..., 1] - self._limits_rad[..., 0] > REACHED_RAD
        return np.append((off <= REACHED_RAD) & moves[..., None], False)

    def _frames(self, rotations: Array, angles_rad: Array) -> Array:
        """(15, 3, 3) frames that the angles of each joint turn in; rotations (5, 4, 3, 3).

        That of a root is the digit's at zero angles, that of a hinge the bone's before it.
        """
        frames = np.empty((5, 3, 3, 3))
        for row in range(5):
            abduction, flexion = np.clip(angles_rad[row, :2], -7.0, 7.0)
            back = rotation_x(flexion) @ rotation_y(-self._side * abduction)
            frames[row, 0] = rotations[row, 0] @ back
        frames[:, 1:] = rotations[:, :2]
        return frames.reshape(15, 3, 3)


def _digit(limits_rad: Array, row: int, side: float) -> list[_Part]:
    """The cone of a digit's root and the arcs of its two hinges; limits_rad (4, 2)."""
    angle = 4 * row
    (low, high), flexion = limits_rad[0], limits_rad[1]
    if high - low > REACHED_RAD:
        root = _cone(limits_rad[:2], angle, side)
    else:
        root = _arc(flexion, angle + 1, side * low)
    return [root, _arc(limits_rad[2], angle + 2), _arc(limits_rad[3], angle + 3)]


def _arc(limits_rad: Array, angle: int, turn_rad: float = 0.0) -> _Part:
    """From the low to the high limit of a flexion, with a spoke at either end."""
    low, high = limits_rad
    points = _directions(turn_rad, np.linspace(low, high, _STEPS + 1))
    ends = np.full(_STEPS, _NOBODY)
    ends[:_LIT_STEPS], ends[-_LIT_STEPS:] = 2 * angle, 2 * angle + 1
    spokes = np.stack([np.zeros((2, 3)), points[[0, -1]]], axis=1)
    lines = np.concatenate([_chained(points), spokes])
    return _Part(lines, np.append(ends, [2 * angle, 2 * angle + 1]))


def _cone(limits_rad: Array, angle: int, side: float) -> _Part:
    """The rim that an abduction and a flexion leave a bone, with spokes to its corners."""
    turns, flexions = np.linspace(limits_rad[:, 0], limits_rad[:, 1], _SIDE_STEPS + 1).T
    rim = {
        2 * angle: _directions(side * turns[0], flexions),
        2 * angle + 1: _directions(side * turns[-1], flexions),
        2 * angle + 2: _directions(side * turns, flexions[0]),
        2 * angle + 3: _directions(side * turns, flexions[-1]),
    }
    corners = np.concatenate([rim[2 * angle][[0, -1]], rim[2 * angle + 1][[0, -1]]])
    spokes = np.stack([np.zeros((4, 3)), corners], axis=1)
    lines = np.concatenate([*map(_chained, rim.values()), spokes])
    return _Part(lines, np.append(np.repeat(list(rim), _SIDE_STEPS), [_NOBODY] * 4))


def _directions(turn_rad: Array | float, flexion_rad: Array | float) -> Array:
    """(n, 3): where a bone points, turned about +y, then about -x: R_y(t) R_x(-f) (-z)."""
    turn, flexion = np.broadcast_arrays(turn_rad, flexion_rad)
    ahead = np.cos(flexion)
    return np.stack([-np.sin(turn) * ahead, -np.sin(flexion), -np.cos(turn) * ahead], axis=-1)


def _chained(points: Array) -> Array:
    """Lines (n - 1, 2, 3) from each point to the next."""
    return np.stack([points[:-1], points[1:]], axis=1)
