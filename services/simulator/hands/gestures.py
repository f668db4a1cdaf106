"""Hand motions as pure functions of time: twice continuously differentiable, inside the joint
limits of any hand.

A motion gives the joint angles, and how the wrist moves relative to its place in the scene. Poses
are written in degrees for the limits of the tables in rhot/hand.py, and are mapped affinely to the
limits of one person's hand. So no limit can be passed, and there are no kinks as clipping would
make. DIP = ratio * PIP is the hand model's own coupling, RHOT eq. (4). Time may be any real number.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel, default_hand

TAU = 2.0 * np.pi


class Gesture(NamedTuple):
    """One instant of a motion.

    turn_rad and shift_m move the hand in the frame of the resting wrist; grip is 0 while the hand
    is empty and 1 while it holds an object. calm and calm_digits are 0 where hand and digits move
    without meaning to, as they always do, and 1 where something that stands steadies them.
    """

    angles_rad: Array  # (5, 4)
    turn_rad: Array  # (3,) rotation vector
    shift_m: Array  # (3,)
    grip: float = 0.0
    calm: float = 0.0
    calm_digits: float = 0.0


Motion = Callable[[float], Gesture]
_ZERO = np.zeros(3)

# Poses in degrees, rows thumb (abduction, cmc, mcp, dip) and fingers (abduction, mcp, pip, dip);
# the last column is set by the coupling.
OPEN = np.array(
    [[6, -6, 6, 0], [5, 8, 12, 0], [0, 6, 12, 0], [-3, 8, 14, 0], [-7, 10, 16, 0]], dtype=float
)
# The finger study's fist (figure 5) ends near the limits: MCP 80-90, PIP 95-110.
FIST = np.array(
    [[10, 6, 24, 0], [1, 82, 102, 0], [0, 84, 104, 0], [-1, 84, 102, 0], [-2, 82, 98, 0]],
    dtype=float,
)
CURVED = np.array(
    [[12, 0, 14, 0], [4, 22, 34, 0], [0, 22, 36, 0], [-3, 22, 34, 0], [-6, 22, 32, 0]], dtype=float
)
# Thumb and index finger of the default hand touch, 15.6 mm between the middles of their last balls;
# found by least squares.
PINCH = np.array(
    [[17, 16, 37, 0], [3, 54, 48, 0], [0, 30, 30, 0], [-2, 24, 26, 0], [-5, 20, 24, 0]], dtype=float
)
# Around a handle of 40 mm.
GRIP = np.array(
    [[22, 0, 18, 0], [2, 52, 66, 0], [0, 54, 66, 0], [-2, 55, 66, 0], [-4, 55, 64, 0]], dtype=float
)


def smootherstep(u: float) -> float:
    """0 below 0, 1 above 1, and between them the quintic whose first and second derivatives vanish
    at both ends (Perlin's smootherstep).
    """
    u = min(1.0, max(0.0, u))
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def bump(u: float) -> float:
    """0 at 0, 1 at 1/2, 0 at 1, constant beyond: one stroke."""
    return smootherstep(2.0 * u) * smootherstep(2.0 - 2.0 * u)


class LimitScaling:
    """Maps degrees written for the table limits to angles inside one hand's own limits."""

    def __init__(self, model: HandModel) -> None:
        table = default_hand(model.hand).limits_rad  # (5, 4, 2)
        own = model.limits_rad
        span = table[..., 1] - table[..., 0]
        # A joint that cannot move in the tables (abduction of the middle finger) stays in the
        # middle of its own range.
        self._scale = np.where(
            span > 0.0, (own[..., 1] - own[..., 0]) / np.where(span > 0.0, span, 1.0), 0.0
        )
        self._offset = (
            own[..., 0]
            - self._scale * table[..., 0]
            + np.where(span > 0.0, 0.0, 0.5 * (own[..., 1] - own[..., 0]))
        )
        self._low, self._high = own[:, 3, 0], own[:, 3, 1]
        # The coupled joint follows as far as its own limit allows.
        reach = np.maximum(own[:, 2, 1], 1e-9)
        self._ratio = np.minimum(
            [digit.coupling for digit in model.digits], np.maximum(self._high, 0.0) / reach
        )

    def __call__(self, degrees: Array) -> Array:
        """Angles (5, 4) rad of degrees (5, 4); the last column is replaced by the coupling."""
        angles = self._offset + self._scale * np.deg2rad(degrees)
        angles[:, 3] = np.clip(self._ratio * angles[:, 2], self._low, self._high)
        return angles


def still(model: HandModel, _seed: int) -> Motion:
    """A hand held open."""
    angles = LimitScaling(model)(OPEN)
    return lambda _t: Gesture(angles, _ZERO, _ZERO)


def fist(model: HandModel, _seed: int) -> Motion:
    """The palmar grasp of the finger study: 2 s closing, 2 s opening.

    PIP leads, MCP follows after a third of the closing.
    """
    scale = LimitScaling(model)
    # The fingers do not close as one: the little finger leads by a few frames.
    lead_s = np.array([-0.10, 0.0, 0.02, 0.05, 0.09])

    def at(t_s: float) -> Gesture:
        share = np.empty((5, 4))
        for row in range(5):
            phase = (t_s - 0.25 + lead_s[row]) % 4.0
            closed = phase / 2.0 if phase < 2.0 else (4.0 - phase) / 2.0
            lead = smootherstep(closed / 0.95)
            late = smootherstep((closed - 1.0 / 3.0) / 0.6)
            # The thumb follows the fingers over them; of a finger only the MCP joint lags (study,
            # section 5).
            share[row] = (late, late, late, late) if row == 0 else (late, late, lead, lead)
        return Gesture(scale(OPEN + share * (FIST - OPEN)), _ZERO, _ZERO)

    return at


def pinch(model: HandModel, _seed: int) -> Motion:
    """Thumb and index finger meet and part every 2.4 s."""
    scale = LimitScaling(model)
    return lambda t_s: Gesture(scale(OPEN + bump(t_s / 2.4 % 1.0) * (PINCH - OPEN)), _ZERO, _ZERO)


def wave(model: HandModel, _seed: int) -> Motion:
    """The open hand turns about the wrist, 22 deg to either side, once a second."""
    scale = LimitScaling(model)

    def at(t_s: float) -> Gesture:
        swing = np.sin(TAU * t_s)
        flex = np.zeros((5, 4))
        flex[1:, 1] = 5.0 * np.sin(TAU * t_s - 0.7)
        return Gesture(
            scale(OPEN + flex),
            np.array([0.0, np.deg2rad(22.0) * swing, 0.0]),
            np.array([0.02 * swing, 0.0, 0.0]),
        )

    return at


# Which digit strikes, in eighths of a bar of 2.4 s: a five-finger exercise up and down.
_NOTES = (0, 1, 2, 3, 4, 3, 2, 1)
_BAR_S = 2.4


def piano(model: HandModel, _seed: int) -> Motion:
    """Digits strike one after the other, up and down, a note each 0.3 s."""
    scale = LimitScaling(model)
    stroke = np.array(
        [[-4, 8, 12, 0], [0, 24, 18, 0], [0, 24, 18, 0], [0, 24, 18, 0], [0, 24, 18, 0]],
        dtype=float,
    )

    def at(t_s: float) -> Gesture:
        press = np.zeros(5)
        for note, digit in enumerate(_NOTES):
            # A stroke takes twice the time of a note: one finger rises while the next one falls.
            press[digit] += bump((t_s - note * _BAR_S / 8) % _BAR_S / (_BAR_S / 4))
        sway = 0.012 * np.sin(TAU * t_s / _BAR_S)
        return Gesture(scale(CURVED + press[:, None] * stroke), _ZERO, np.array([sway, 0.0, 0.0]))

    return at


def grab(model: HandModel, _seed: int) -> Motion:
    """Every 8 s the hand closes around the object, carries it about, brings it back and opens."""
    scale = LimitScaling(model)

    def at(t_s: float) -> Gesture:
        phase = t_s % 8.0
        # Open until 0.6 s, closed from 1.8 to 6.2 s; carried between 1.9 and 6.1 s, when the grip
        # no longer changes.
        grip = smootherstep((phase - 0.6) / 1.2) * smootherstep((7.4 - phase) / 1.2)
        carry = smootherstep((phase - 1.9) / 0.9) * smootherstep((6.1 - phase) / 0.9)
        angle = TAU * (phase - 1.9) / 4.2
        shift = carry * np.array(
            [0.035 * np.sin(angle), 0.03 * np.sin(2.0 * angle), -0.04 * (1.0 - np.cos(angle)) / 2.0]
        )
        turn = carry * np.array(
            [0.15 * np.sin(angle), 0.25 * np.sin(angle), 0.2 * np.sin(2.0 * angle)]
        )
        held = smootherstep((phase - 1.7) / 0.2) * smootherstep((6.3 - phase) / 0.2)
        return Gesture(scale(OPEN + grip * (GRIP - OPEN)), turn, shift, held)

    return at


def random(model: HandModel, seed: int) -> Motion:
    """Every joint moves independently through 80 % of its range, band-limited to 0.8 Hz.

    The hand as a whole turns and shifts below 0.4 Hz.
    """
    scale = LimitScaling(model)
    rng = np.random.default_rng([seed, 7])
    limits = np.rad2deg(default_hand(model.hand).limits_rad)
    middle, half = limits.mean(axis=2), 0.4 * (limits[..., 1] - limits[..., 0])
    # Independent fingers far apart in flexion would pass through each other: abduction keeps to a
    # third of its range.
    half[1:, 0] /= 3.0
    joints = _SumOfSines(rng, (5, 4), 0.8)
    turns = _SumOfSines(rng, (3,), 0.4)
    shifts = _SumOfSines(rng, (3,), 0.4)

    def at(t_s: float) -> Gesture:
        return Gesture(
            scale(middle + half * joints(t_s)), np.deg2rad(14.0) * turns(t_s), 0.03 * shifts(t_s)
        )

    return at


class _SumOfSines:
    """Random sums of four sines below a limiting frequency, each sum within -1..1."""

    def __init__(self, rng: np.random.Generator, shape: tuple[int, ...], limit_hz: float) -> None:
        self._omega = TAU * limit_hz * rng.uniform(0.15, 1.0, (*shape, 4))
        self._phase = rng.uniform(0.0, TAU, (*shape, 4))
        weight = rng.uniform(0.5, 1.0, (*shape, 4))
        self._weight = weight / weight.sum(axis=-1, keepdims=True)

    def __call__(self, t_s: float) -> Array:
        return np.sum(self._weight * np.sin(self._omega * t_s + self._phase), axis=-1)


MOTIONS: dict[str, Callable[[HandModel, int], Motion]] = {
    "fist": fist,
    "pinch": pinch,
    "wave": wave,
    "piano": piano,
    "grab": grab,
    "random": random,
    "still": still,
}
