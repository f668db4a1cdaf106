"""Everything that is compared: references with each other, judged recordings with their band. Pure.

Several recordings of one person count as one: the mean of their paths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from studies.grasp.compare.band import (
    MIN_REFERENCES,
    Band,
    CurveBand,
    Judged,
    Leaving,
    band_of,
    curve_band,
    curve_leavings,
    judged,
)
from studies.grasp.compare.markers import Choice, Noise, choices, noise_of
from studies.grasp.compare.paths import TipPath
from studies.grasp.compare.shape import procrustes, warping
from studies.grasp.recording import ANGLES

# deg; no band of a joint's angle is narrower: what dots measure.
_ANGLE_FLOOR_DEG = 2.0


class Someone(NamedTuple):
    """One person's mean path and curves."""

    subject: str
    path: Array  # (n, 2) in lengths of the finger
    angles_deg: Array  # (n, 3), NaN where not measured
    recordings: list[TipPath]


class JudgedPerson(NamedTuple):
    """One recording against the references."""

    someone: Someone
    shape: Judged
    joints: dict[str, list[Leaving]]  # by joint, deg


class Comparison(NamedTuple):
    """What `compare` found; band is None where there are too few references, and why says so."""

    people: list[Someone]  # references first
    references: int
    procrustes: Array  # (k, k) of people, lengths of the finger
    warping: Array  # (k, k)
    lag: Array  # (k, k) shares of the closing
    band: Band | None
    joint_bands: dict[str, CurveBand]
    judged: list[JudgedPerson]
    why_no_band: str
    noise: Noise
    choices: list[Choice]


def compared(
    references: Sequence[TipPath],
    others: Sequence[TipPath],
    dot_mm: float,
    begun: Callable[[int], Callable[[], None]],
) -> Comparison:
    """Raises CaptureError where fingers differ."""
    fingers = sorted({one.finger for one in [*references, *others]})
    if len(fingers) > 1:
        raise CaptureError(
            f"recordings of {' and '.join(fingers)}: a path is compared with those of the same"
            f" finger; name one, such as --finger {fingers[0]}"
        )
    known, new = _people(references), _people(others)
    everybody = [*known, *new]
    band, joint_bands, why = None, {}, ""
    try:
        band = band_of([one.path for one in known])
        joint_bands = _joint_bands(known)
    except CaptureError as error:
        why = str(error)
    pairs = [[warping(a.path, b.path) for b in everybody] for a in everybody]
    noise = noise_of([*references, *others], dot_mm)
    return Comparison(
        people=everybody,
        references=len(known),
        procrustes=np.array(
            [[procrustes(a.path, b.path).distance for b in everybody] for a in everybody]
        ),
        warping=np.array([[one.distance for one in row] for row in pairs]),
        lag=np.array([[one.lag for one in row] for row in pairs]),
        band=band,
        joint_bands=joint_bands,
        judged=[_judged(one, band, joint_bands) for one in new] if band is not None else [],
        why_no_band=why,
        noise=noise,
        choices=choices([*references, *others], noise, begun),
    )


def _people(paths: Sequence[TipPath]) -> list[Someone]:
    """By subject, in the order of the recordings."""
    grouped: dict[str, list[TipPath]] = {}
    for one in paths:
        grouped.setdefault(one.subject, []).append(one)
    return [
        Someone(
            subject,
            np.mean([one.path for one in own], axis=0),
            np.mean([one.angles_deg for one in own], axis=0),
            own,
        )
        for subject, own in grouped.items()
    ]


def _joint_bands(known: Sequence[Someone]) -> dict[str, CurveBand]:
    """Of each joint that enough references measured."""
    bands = {}
    for k, joint in enumerate(ANGLES):
        curves = [one.angles_deg[:, k] for one in known if np.isfinite(one.angles_deg[:, k]).all()]
        if len(curves) >= MIN_REFERENCES:
            bands[joint] = curve_band(curves, _ANGLE_FLOOR_DEG)
    return bands


def _judged(one: Someone, band: Band, joint_bands: dict[str, CurveBand]) -> JudgedPerson:
    joints = {}
    for k, joint in enumerate(ANGLES):
        curve = one.angles_deg[:, k]
        if joint in joint_bands and np.isfinite(curve).all():
            joints[joint] = curve_leavings(curve, joint_bands[joint])
    return JudgedPerson(one, judged(one.path, band), joints)
