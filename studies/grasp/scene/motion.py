"""How a hand closes and opens: angles, cycle by cycle, and the sway of a hand that is held still.

The paper's Fig. 5: of a fist, PIP flexes from the start and about linearly, MCP waits for a third
of the closing and then rises steeply. A pinch, where the thumb is seen too, closes both half way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.subjects import Subject

# MCP and PIP of the open hand: a relaxed finger is never straight.
_OPEN_DEG = (4.0, 9.0)
# Of a fist MCP waits this long, and PIP is done here, both as shares of the closing (Fig. 5).
_MCP_FROM, _PIP_UNTIL = 0.25, 0.92
# A pinch: MCP and PIP where the tips meet, and the thumb's three angles, open and closed; it bends
# against the finger, so that its flexion is negative.
_PINCH_DEG = (46.0, 58.0)
_THUMB_OPEN_DEG, _THUMB_CLOSED_DEG = (50.0, -12.0, -10.0), (80.0, -50.0, -42.0)
# A thumb that has nothing to do hangs below the palm.
_THUMB_ASIDE_DEG = (44.0, -4.0, -6.0)
_REST_S = (0.25, 0.6)


class Cycles(NamedTuple):
    """What is performed: number closings of period_s with their openings (the paper: 5 of 4 s), in
    pictures of fps. pinch: thumb and index finger meet instead of a fist. sway: 1 is a hand held
    still in the air (2 mm, 1.5 deg), 0 one that rests on something.
    """

    number: int = 5
    period_s: float = 4.0
    fps: float = 30.0
    pinch: bool = False
    sway: float = 1.0


class Motion(NamedTuple):
    """n pictures. angles: MCP, PIP, DIP; thumb: CMC, MP, IP; shift in mm and turn of the hand in
    the plane; angles in radians. cycle counts from 0, and closing says which pictures close.
    """

    time_s: Array  # (n,)
    angles: Array  # (n, 3)
    thumb: Array  # (n, 3)
    shift: Array  # (n, 2)
    turn: Array  # (n,)
    cycle: Array  # (n,)
    closing: Array  # (n,) bool


def perform(subject: Subject, cycles: Cycles, seed: int) -> Motion:
    """One subject's cycles; the same seed gives the same motion."""
    rng = np.random.default_rng((seed, 1))
    closed, closing, cycle = _phases(cycles, rng)
    time_s = np.arange(len(closed)) / cycles.fps
    tops = _PINCH_DEG if cycles.pinch else subject.closed_deg
    # People do not repeat themselves to the degree.
    top = np.radians(np.asarray(tops) + rng.normal(0.0, 2.0, (cycles.number, 2)))[cycle]
    bottom = np.radians(np.asarray(_OPEN_DEG) + rng.normal(0.0, 1.5, (cycles.number, 2)))[cycle]
    wait = 0.0 if cycles.pinch else _MCP_FROM
    mcp_share = _eased((closed - wait) / (1.0 - wait))
    pip_share = 0.65 * np.clip(closed / _PIP_UNTIL, 0.0, 1.0) + 0.35 * _eased(closed / _PIP_UNTIL)
    mcp = bottom[:, 0] + (top - bottom)[:, 0] * mcp_share + _tremor(time_s, 0.6, rng)
    pip = bottom[:, 1] + (top - bottom)[:, 1] * pip_share + _tremor(time_s, 0.5, rng)
    dip = subject.law.dip(pip) + _tremor(time_s, 0.6, rng)
    thumb_open, thumb_closed = np.radians(_THUMB_OPEN_DEG), np.radians(_THUMB_CLOSED_DEG)
    thumb = thumb_open + _eased(closed)[:, None] * (thumb_closed - thumb_open)
    if not cycles.pinch:
        thumb = np.tile(np.radians(_THUMB_ASIDE_DEG), (len(closed), 1))
    thumb = thumb + np.stack([_tremor(time_s, 0.5, rng) for _ in range(3)], axis=1)
    # _tremor is in radians of degrees: 115 makes 2 mm of its 1 degree.
    shift = [115.0 * cycles.sway * _tremor(time_s, 1.0, rng, 0.25) for _ in range(2)]
    turn = cycles.sway * _tremor(time_s, 0.75, rng, 0.2)
    angles = np.stack([mcp, pip, dip], axis=1)
    return Motion(time_s, angles, thumb, np.stack(shift, axis=1), turn, cycle, closing)


def _phases(cycles: Cycles, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Of each picture: how far closed, 0..1; whether it closes; its cycle. (n,) each."""
    closed: list[Array] = []
    closing: list[Array] = []
    cycle: list[Array] = []
    for number in range(cycles.number):
        half_s = 0.5 * cycles.period_s * rng.uniform(0.9, 1.1, 2)
        rest_s = rng.uniform(*_REST_S, 2) * min(1.0, cycles.period_s / 4.0)
        counts = [max(2, round(s * cycles.fps)) for s in (half_s[0], rest_s[0], half_s[1])]
        counts.append(max(1, round(rest_s[1] * cycles.fps)))
        ways = (
            np.linspace(0.0, 1.0, counts[0]),
            np.ones(counts[1]),
            np.linspace(1.0, 0.0, counts[2]),
            np.zeros(counts[3]),
        )
        closed += ways
        closing += [np.full(len(way), first == 0) for first, way in enumerate(ways)]
        cycle.append(np.full(sum(counts), number))
    return np.concatenate(closed), np.concatenate(closing), np.concatenate(cycle)


def _eased(share: Array) -> Array:
    """Minimum jerk from 0 to 1 (Flash & Hogan 1985)."""
    p = np.clip(share, 0.0, 1.0)
    return p * p * p * (10.0 - 15.0 * p + 6.0 * p * p)


def _tremor(time_s: Array, size_deg: float, rng: np.random.Generator, rate: float = 1.0) -> Array:
    """A slow wander, RMS size_deg, in radians (n,); rate 1 is up to 2 Hz."""
    hz = rate * rng.uniform(0.15, 2.0, 5)
    phase = rng.uniform(0.0, 2.0 * np.pi, 5)
    waves = np.sin(2.0 * np.pi * hz * time_s[:, None] + phase) / np.sqrt(2.5)  # (n, 5)
    return np.radians(size_deg) * waves.sum(axis=1)
