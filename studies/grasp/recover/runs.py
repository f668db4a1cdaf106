"""One method over the frames of a sequence, each starting from the last one's angles. Pure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from services.solver.finger.dls_paper import INITIAL_ANGLES_RAD
from studies.grasp.planar import chain_of
from studies.grasp.recover.laws import Law
from studies.grasp.recover.methods import METHODS, Finger, Step, Target
from studies.grasp.recover.result import MethodRun, Outcome, numbers
from studies.grasp.track import FingerTrack

# rad; an angle this near to its limit stands at it.
_AT_LIMIT_RAD = 1e-6
_OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
_MISSING = {
    "position": "the tip's position was not measured",
    "direction": "the tip's direction was not measured",
    "angles": "the angles were not measured",
    "law": "too few frames measured PIP and DIP for a law of their own",
}


class Work(NamedTuple):
    """One sequence, and the finger that made it."""

    track: FingerTrack
    lengths: Array  # (3,) fixed
    measured_lengths: Array  # (n, 3), NaN where not measured
    limits: Array  # (4, 2)
    law: Law | None
    doubt: float  # sigma of the fixed lengths together, as a share of them
    scale: float  # solver's units per unit of the recording


def run_method(name: str, work: Work, clock_s: Callable[[], float]) -> list[MethodRun]:
    """With fixed lengths, and with those of each frame where they were measured.

    (Lengths measured with the joints use more than the path of the tip: the paper's curve p_v.)
    """
    runs = [_run(name, "fixed", work, np.tile(work.lengths, (len(work.track.times_s), 1)), clock_s)]
    if np.isfinite(work.measured_lengths).all(axis=1).any():
        runs.append(_run(name, "measured", work, work.measured_lengths, clock_s))
    return runs


def _run(
    name: str,
    kind: Literal["fixed", "measured"],
    work: Work,
    lengths: Array,
    clock_s: Callable[[], float],
) -> MethodRun:
    method, track = METHODS[name], work.track
    ready = _ready(method.needs, work) & np.isfinite(lengths).all(axis=1)
    steps: list[Step | None] = [None] * len(ready)
    # The paper's first posture, for all: [0, pi/2, 0, 0].
    start = np.clip(INITIAL_ANGLES_RAD[1:], work.limits[1:, 0], work.limits[1:, 1])
    began_s = clock_s()
    for k in np.flatnonzero(ready).tolist():
        bones = lengths[k] * work.scale
        doubt = work.doubt if kind == "fixed" else 0.0
        finger = Finger(chain_of(bones, work.limits), bones, work.law, doubt)
        target = Target(
            track.tip[k] * work.scale,
            float(track.direction_rad[k]),
            track.angles_rad[k],
            float(track.sigma[k] * work.scale),
            first=k == int(np.argmax(ready)),
        )
        steps[k] = step = method.solve(finger, target, start)
        start = step.angles
    spent_s = clock_s() - began_s
    angles = np.array([np.full(3, np.nan) if one is None else one.angles for one in steps])
    lefts = np.array([np.nan if one is None else one.left / work.scale for one in steps])
    at_limit = (np.abs(angles[:, :, None] - work.limits[None, 1:]) <= _AT_LIMIT_RAD).any(axis=2)
    counts = at_limit.sum(axis=0).tolist()
    return MethodRun(
        method=name,
        lengths=kind,
        angles_rad=[numbers(row) for row in angles],
        iterations=[0 if one is None else int(one.iterations) for one in steps],
        left=numbers(lefts),
        outcomes=["not_run" if one is None else _OUTCOMES[one.outcome] for one in steps],
        at_limit=(counts[0], counts[1], counts[2]),
        seconds_a_frame=spent_s / max(int(ready.sum()), 1),
        why_not_run="" if ready.any() else _MISSING[method.needs],
    )


def _ready(needs: str, work: Work) -> npt.NDArray[np.bool_]:
    """Which frames (n,) measured what a method needs."""
    track = work.track
    ready = np.isfinite(track.tip[:, 0]) & np.isfinite(track.tip[:, 1])
    if needs == "direction":
        ready &= np.isfinite(track.direction_rad)
    elif needs == "angles":
        ready &= np.isfinite(track.angles_rad).all(axis=1)
    elif needs == "law" and work.law is None:
        ready[:] = False
    return ready
