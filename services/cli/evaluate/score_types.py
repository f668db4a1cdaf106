"""What `rhot score` reports, in the units people read (mm, deg, ms), ready for JSON.

A value that could not be measured is None, never zero: the delay of a hand at rest, for example.
"""

from __future__ import annotations

import msgspec

from services.cli.evaluate.contacts.contact_score import ContactScore

Vec3 = tuple[float, float, float]


class PointError(msgspec.Struct, frozen=True, kw_only=True):
    """Error of one point in mm: mean (bias) and RMS along the rig's x, y, z.

    total_rms_mm and max_mm are of the error's length.
    """

    bias_mm: Vec3
    rms_mm: Vec3
    total_rms_mm: float
    max_mm: float


class AngleError(msgspec.Struct, frozen=True, kw_only=True):
    """Error of one joint angle in deg: signed mean (bias), mean and maximum of its size.

    A fixed joint cannot move (its limits are equal), so its error is no error of the estimate.
    """

    bias_deg: float
    mean_deg: float
    max_deg: float
    fixed: bool


class OrientationError(msgspec.Struct, frozen=True, kw_only=True):
    """Angle between two orientations in deg."""

    mean_deg: float
    rms_deg: float
    max_deg: float


class Coverage(msgspec.Struct, frozen=True, kw_only=True):
    """How much of the truth has a pose.

    expected: instants of truth; missed: those without a pose within half a frame; longest_gap_ms:
    longest time between two poses, or between the truth's ends and a pose; outside: poses before or
    after the truth, which are not scored.
    """

    expected: int
    missed: int
    missed_share: float
    longest_gap_ms: float
    outside: int


class Violations(msgspec.Struct, frozen=True, kw_only=True):
    """Joint angles beyond the limits of the hand: how many, the largest excess and its joint.

    Each joint of each pose counts.
    """

    count: int
    worst_deg: float
    worst_joint: str


class HandScore(msgspec.Struct, frozen=True, kw_only=True):
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
    orientation: OrientationError
    coverage: Coverage
    violations: Violations
    delay_ms: float | None


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """How large errors are: half are below median, 95 % below p95. Unit: that of its field."""

    median: float
    rms: float
    p95: float
    max: float


class ObjectScore(msgspec.Struct, frozen=True, kw_only=True):
    """One object against its truth.

    Poses that are not ok, or not registered (lighthouse frame), are counted and not scored. states
    counts poses by their tracking, ok_share is of all poses. delay_ms is that of the content, as
    HandScore's; latency_ms how late poses were sent, None of a result of `rhot track`.
    """

    poses: int
    scored: int
    unregistered: int
    position: PointError | None
    orientation: OrientationError | None
    coverage: Coverage
    delay_ms: float | None
    states: dict[str, int] = {}
    ok_share: float = 0.0
    position_mm: Spread | None = None
    orientation_deg: Spread | None = None
    velocity_mm_s: Spread | None = None
    latency_ms: float | None = None


class MarkerError(msgspec.Struct, frozen=True, kw_only=True):
    """Blobs of one colour in one camera against the projected landmark.

    found_share: of the frames; strays: blobs too far away, which are false detections; bias and RMS
    are of the others.
    """

    found_share: float
    strays: int
    bias_px: tuple[float, float]
    rms_px: tuple[float, float]


class PointStage(msgspec.Struct, frozen=True, kw_only=True):
    """3D points of one landmark against its truth.

    found_share: of the instants; predicted_share: of the points found, those without a measurement.
    """

    found_share: float
    predicted_share: float
    error: PointError


class Stages(msgspec.Struct, frozen=True, kw_only=True):
    """Errors before the hand is solved: markers per camera and landmark, points per landmark."""

    markers: dict[str, dict[str, MarkerError]]
    points: dict[str, PointStage]


class Score(msgspec.Struct, frozen=True, kw_only=True):
    """All of a result against the capture it was made from; stages only where asked for.

    contacts has the objects whose shape the simulator knows.
    """

    hands: dict[str, HandScore]
    objects: dict[str, ObjectScore]
    stages: dict[str, Stages] = {}
    contacts: dict[str, ContactScore] = {}
    notes: list[str] = []
