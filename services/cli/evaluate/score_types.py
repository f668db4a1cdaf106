"""What `rhot score` finds: frozen results, in the units people read (mm, deg, ms), ready for JSON.

A value that could not be measured is None, never zero: a delay of a hand that does not move, angles
when no pose was scored.
"""

from __future__ import annotations

import msgspec

Vec3 = tuple[float, float, float]


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all scores."""


class PointError(Result, frozen=True, kw_only=True):
    """Error of one point along the rig's x, y, z in mm: its mean (bias), its RMS, and the RMS and
    maximum of its length.
    """

    bias_mm: Vec3
    rms_mm: Vec3
    total_rms_mm: float
    max_mm: float


class AngleError(Result, frozen=True, kw_only=True):
    """Error of one joint angle in deg: signed mean (bias), mean and maximum of its size.

    A fixed joint has no freedom to err.
    """

    bias_deg: float
    mean_deg: float
    max_deg: float
    fixed: bool


class TurnError(Result, frozen=True, kw_only=True):
    """Angle between two orientations in deg."""

    mean_deg: float
    rms_deg: float
    max_deg: float


class Coverage(Result, frozen=True, kw_only=True):
    """How much of the truth was answered.

    expected: instants of truth; missed: those without a pose within half a frame; longest_gap_ms:
    longest time between two poses (or from the first or to the last truth); outside: poses before
    or after the truth, which are not scored.
    """

    expected: int
    missed: int
    missed_share: float
    longest_gap_ms: float
    outside: int


class Violations(Result, frozen=True, kw_only=True):
    """Joint angles beyond the limits of the hand: how many (poses times joints), the worst excess
    and where it is.
    """

    count: int
    worst_deg: float
    worst_joint: str


class HandScore(Result, frozen=True, kw_only=True):
    """One hand against its truth."""

    poses: int
    scored: int
    predicted: int
    distance_m: float
    tips: dict[str, PointError]
    tips_rms_mm: float
    angles: dict[str, dict[str, AngleError]]
    angles_mean_deg: float
    wrist: PointError
    orientation: TurnError
    coverage: Coverage
    violations: Violations
    delay_ms: float | None


class ObjectScore(Result, frozen=True, kw_only=True):
    """One object against its truth.

    Unregistered poses (lighthouse frame) are counted and not scored.
    """

    poses: int
    scored: int
    unregistered: int
    position: PointError | None
    orientation: TurnError | None
    coverage: Coverage
    delay_ms: float | None


class MarkerError(Result, frozen=True, kw_only=True):
    """Blobs of one colour in one camera against the projected landmark.

    found_share of the frames; strays are blobs elsewhere; bias and RMS of the rest.
    """

    found_share: float
    strays: int
    bias_px: tuple[float, float]
    rms_px: tuple[float, float]


class PointStage(Result, frozen=True, kw_only=True):
    """3D points of one landmark against its truth: share of instants that hold it, and of those the
    share only predicted.
    """

    found_share: float
    predicted_share: float
    error: PointError


class Stages(Result, frozen=True, kw_only=True):
    """Errors before the hand is solved: markers per camera and landmark, points per landmark."""

    markers: dict[str, dict[str, MarkerError]]
    points: dict[str, PointStage]


class Score(Result, frozen=True, kw_only=True):
    """All of a result against the capture it was made from; stages only where asked for."""

    hands: dict[str, HandScore]
    objects: dict[str, ObjectScore]
    stages: dict[str, Stages] = {}
    notes: list[str] = []
