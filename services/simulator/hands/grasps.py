"""A hand that takes an object, carries it about and puts it back, as a function of time. Pure.

Every 8 s it comes, closes digit by digit until each touches, lifts, carries, puts back, opens and
withdraws: twice continuously differentiable, and inside the joint limits, as every gesture
(gestures.py). While it touches what still stands it holds still: nothing slips.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array, rotation_x, rotation_z
from services.simulator.hands.gestures import TAU, Gesture, Motion, smootherstep
from services.simulator.hands.holds import Hold

_CYCLE_S = 8.0
# Of the cycle, s: the hand comes, and has withdrawn; it carries from and to.
_COME_S, _THERE_S, _LEAVE_S, _GONE_S = 0.2, 1.1, 6.6, 7.5
_LIFT_S, _DOWN_S = 2.35, 5.45
# Earliest a digit begins to close, latest it has closed; the same for opening.
_CLOSE_S, _OPEN_S = (1.15, 2.3), (5.5, 6.5)
# From where the hand comes: this far behind the object, from this far aside.
_AWAY_M, _ASIDE_RAD = 0.055, np.deg2rad(25.0)
# A closing digit is as fast as it will be after 60 % of its time, and stops within 15 %: skin stops
# at what it meets, but no joint jumps.
_RISE, _STOP = 0.6, 0.15


class Timing(NamedTuple):
    """Of one hand; s of the cycle, digits in the order of DIGITS."""

    close_from_s: Array  # (5,)
    close_s: Array  # (5,) how long
    open_to_s: Array  # (5,)
    away_m: Array  # (3,) where it waits, from where it holds, in the wrist frame
    carry: bool


def timing(seed: int, *, carry: bool = True) -> Timing:
    """How the hand of that seed goes about it: early or late thumb, from one side or the other."""
    rng = np.random.default_rng([seed, 43])
    close_s = rng.uniform(0.55, 0.8, 5)
    late = rng.uniform(0.0, 1.0, 5)
    # The thumb is first, last, or among the others.
    late[0] = rng.choice([0.0, 1.0, 0.5])
    open_late = rng.uniform(0.0, 1.0, 5)
    about_x, about_z = rng.uniform(-_ASIDE_RAD, _ASIDE_RAD, 2)
    away = rotation_z(float(about_z)) @ rotation_x(float(about_x)) @ np.array([0.0, _AWAY_M, 0.0])
    return Timing(
        close_from_s=_CLOSE_S[0] + late * (_CLOSE_S[1] - _CLOSE_S[0] - close_s),
        close_s=close_s,
        open_to_s=_OPEN_S[0] + close_s + open_late * (_OPEN_S[1] - _OPEN_S[0] - close_s),
        away_m=away,
        carry=carry,
    )


def grasp(hold: Hold, plan: Timing) -> Motion:
    """The motion of a hand that holds an object like that; it rests where it holds it."""

    def at(t_s: float) -> Gesture:
        phase = t_s % _CYCLE_S
        here = _window(phase, (_COME_S, _THERE_S), (_LEAVE_S, _GONE_S))
        closed = np.array(
            [
                stop((phase - begin) / length) * stop((end - phase) / length)
                for begin, length, end in zip(
                    plan.close_from_s, plan.close_s, plan.open_to_s, strict=True
                )
            ]
        )
        angles = hold.open_rad + closed[:, None] * (hold.closed_rad - hold.open_rad)
        shift, turn = _carried(phase) if plan.carry else (np.zeros(3), np.zeros(3))
        carried = _window(phase, (_LIFT_S, _LIFT_S + 0.5), (_DOWN_S - 0.5, _DOWN_S))
        still = _window(phase, (_COME_S + 0.3, _THERE_S - 0.2), (_LEAVE_S + 0.2, _GONE_S - 0.3))
        return Gesture(
            angles,
            turn,
            shift + (1.0 - here) * plan.away_m,
            grip=1.0 if plan.carry and _LIFT_S <= phase <= _DOWN_S else 0.0,
            calm=still * (1.0 - (carried if plan.carry else 0.0)),
            calm_digits=still,
        )

    return at


def stop(u: float) -> float:
    """0 below 0, 1 above 1, with a long start and a short end; twice continuously differentiable.

    The integral of a speed that rises over _RISE and falls over _STOP as smoothstep does.
    """
    u = min(1.0, max(0.0, u))
    total = 1.0 - 0.5 * (_RISE + _STOP)
    if u < _RISE:
        return _RISE * _ramp(u / _RISE) / total
    if u <= 1.0 - _STOP:
        return (u - 0.5 * _RISE) / total
    return 1.0 - _STOP * _ramp((1.0 - u) / _STOP) / total


def _ramp(x: float) -> float:
    """Integral of smoothstep 3 x^2 - 2 x^3."""
    return x * x * x * (1.0 - 0.5 * x)


def _window(phase: float, rise: tuple[float, float], fall: tuple[float, float]) -> float:
    """0, 1 between the end of the rise and the start of the fall, 0."""
    up = smootherstep((phase - rise[0]) / (rise[1] - rise[0]))
    return up * smootherstep((fall[1] - phase) / (fall[1] - fall[0]))


def _carried(phase: float) -> tuple[Array, Array]:
    """Shift (3,) and turn (3,) of a hand that carries something about, and brings it back."""
    carry = _window(phase, (_LIFT_S, _LIFT_S + 0.9), (_DOWN_S - 0.9, _DOWN_S))
    angle = TAU * (phase - _LIFT_S) / (_DOWN_S - _LIFT_S)
    up = 0.5 * (1.0 - np.cos(angle))
    shift = np.array([0.045 * np.sin(angle), 0.035 * np.sin(2.0 * angle), -0.05 * up])
    turn = np.array([0.15 * np.sin(angle), 0.25 * np.sin(angle), 0.2 * np.sin(2.0 * angle)])
    return carry * shift, carry * turn
