"""Recovered angles against measured ones: RMS, mean, 95 % and maximum per method and joint. Pure.

Over all frames of all sequences at once. Measured angles have noise of their own: an error cannot
be told below it.
"""

from __future__ import annotations

from collections.abc import Sequence as Several
from typing import Literal

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.recording import ANGLES
from studies.grasp.recover.result import MethodRun, Recovery, Sequence, array

# Of FingerTrack.columns: the measured angles.
ANGLE_COLUMNS = slice(8, 11)
_UNREACHED = ("unreachable", "not_converged")


class JointError(msgspec.Struct, frozen=True):
    """Absolute errors in deg; None where no frame measured that angle."""

    joint: str  # mcp, pip, dip, or "all"
    rms: float | None
    mean: float | None
    p95: float | None
    largest: float | None


class MethodError(msgspec.Struct, frozen=True):
    """One method with one kind of lengths."""

    method: str
    lengths: Literal["fixed", "measured"]
    frames: int  # recovered, whether angles were measured or not
    joints: list[JointError]
    first_iterations: int  # of the worst sequence
    later_iterations: int  # of the worst frame
    later_median: float
    later_p95: float
    unreached: int  # frames whose tip is not where it was measured
    at_limit: tuple[int, int, int]
    left_rms: float | None  # the recording's unit
    seconds_a_frame: float
    why_not_run: str


def errors_of(recoveries: Several[Recovery]) -> list[MethodError]:
    """Every method that was asked for, in its order, over all these recordings."""
    keys: dict[tuple[str, Literal["fixed", "measured"]], list[tuple[Sequence, MethodRun]]] = {}
    for recovery in recoveries:
        for sequence in recovery.sequences:
            for run in sequence.runs:
                keys.setdefault((run.method, run.lengths), []).append((sequence, run))
    return [_method_error(*key, runs) for key, runs in keys.items()]


def measured_angles(sequence: Sequence) -> Array:
    """(n, 3) rad, NaN where not measured."""
    return array(sequence.columns)[:, ANGLE_COLUMNS]


def _method_error(
    method: str, lengths: Literal["fixed", "measured"], runs: list[tuple[Sequence, MethodRun]]
) -> MethodError:
    off = np.rad2deg(
        np.concatenate([array(run.angles_rad) - measured_angles(one) for one, run in runs])
    )
    ran = [run for _, run in runs if not run.why_not_run]
    done = [[o != "not_run" for o in run.outcomes] for run in ran]
    steps = [np.array(run.iterations)[kept] for run, kept in zip(ran, done, strict=True)]
    later = np.concatenate([one[1:] for one in steps] or [np.zeros(0)])
    lefts = np.array([one for run in ran for one in run.left if one is not None])
    limits = np.sum([run.at_limit for run in ran], axis=0) if ran else np.zeros(3, int)
    frames = sum(map(sum, done))
    joints = [_joint_error(name, off[:, k]) for k, name in enumerate(ANGLES)]
    return MethodError(
        method=method,
        lengths=lengths,
        frames=frames,
        joints=[*joints, _joint_error("all", off.ravel())],
        first_iterations=max((int(one[0]) for one in steps), default=0),
        later_iterations=int(later.max()) if later.size else 0,
        later_median=float(np.median(later)) if later.size else 0.0,
        later_p95=float(np.percentile(later, 95)) if later.size else 0.0,
        unreached=sum(o in _UNREACHED for run in ran for o in run.outcomes),
        at_limit=(int(limits[0]), int(limits[1]), int(limits[2])),
        left_rms=float(np.sqrt(np.mean(lefts**2))) if lefts.size else None,
        seconds_a_frame=(
            sum(run.seconds_a_frame * sum(kept) for run, kept in zip(ran, done, strict=True))
            / max(frames, 1)
        ),
        why_not_run="" if ran else runs[0][1].why_not_run,
    )


def _joint_error(name: str, off: Array) -> JointError:
    sizes = np.abs(off[np.isfinite(off)])
    if not sizes.size:
        return JointError(name, None, None, None, None)
    return JointError(
        joint=name,
        rms=float(np.sqrt(np.mean(sizes**2))),
        mean=float(sizes.mean()),
        p95=float(np.percentile(sizes, 95)),
        largest=float(sizes.max()),
    )
