"""From the places that were seen in each picture to one recording of each finger. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import msgspec
import numpy as np

from rhot.errors import CaptureError
from studies.grasp.measure.joints import (
    Finger,
    Place,
    Seen,
    base_places,
    fingers_in,
    joints_of,
)
from studies.grasp.measure.plane import (
    CLICK_SIGMA_PX,
    FingerPlan,
    Segment,
    lengths_px,
    measured_frame,
    segments_of,
    turn,
)
from studies.grasp.measure.scale import BONES, NO_SCALE, Scale, known_scale, scale_of_lengths
from studies.grasp.measure.seeds import Method
from studies.grasp.recording import GraspFrame, GraspRecording, Joint

Line = tuple[float, float, float, float]
Flexion = Literal["auto", "clockwise", "counterclockwise"]
# A phalanx: median of its lengths in px, sigma of one length (robust).
Length = tuple[float, float]
# What a base line that was given as two points of the picture is called among the places.
GIVEN_BASE = Segment("base_start", "base_end")
_NOTES = {
    "edges": "bones are as long as all pictures together say",
    "edges-paper": "joints are the centroids of the paper's regions",
}
# A normal distribution's sigma is so much of its median absolute deviation.
_SIGMA_PER_MAD = 1.4826
# A phalanx that looks this much longer or shorter than its median is not in the plane, or a dot is
# not where it was: 20 % is a tilt of 37 degrees (cos), more than skin stretches over a joint.
_LENGTH_TOLERANCE = 0.2
_DOUBTFUL = 0.5


@dataclass(frozen=True)
class Wanted:
    """What a person says beside the seeds.

    base: two points of the corrected picture, towards the finger; flexion: which way fingers close
    on the screen.
    """

    subject: str = "subject"
    source: str = ""
    base: Line | None = None
    flexion: Flexion = "auto"
    mm_per_px: float | None = None
    lengths_mm: Mapping[tuple[Finger, Joint], float] = field(default_factory=dict)


class Finding(NamedTuple):
    """A finger's recording, and how it came about (for drawing it)."""

    plan: FingerPlan
    recording: GraspRecording


def with_base(seen: Seen, base: Line | None) -> Seen:
    """The same picture with the given base line among its places."""
    if base is None:
        return seen
    x0, y0, x1, y1 = base
    ends = {
        GIVEN_BASE.start: Place(x0, y0, CLICK_SIGMA_PX),
        GIVEN_BASE.end: Place(x1, y1, CLICK_SIGMA_PX),
    }
    return seen._replace(places={**seen.places, **ends})


def recordings(
    pictures: Sequence[Seen],
    names: Sequence[str],
    wanted: Wanted,
    method: Method,
    notes: Mapping[str, Sequence[str]],
) -> dict[Finger, Finding]:
    """A recording of each finger of which joints were asked for (names).

    notes: what is known beforehand of each finger, and of all under "". Raises CaptureError where
    no picture shows two joints of any finger.
    """
    pictures = [with_base(seen, wanted.base) for seen in pictures]
    plans = {finger: _plan(finger, names, wanted) for finger in fingers_in(list(names))}
    lengths = {finger: median_lengths(plan, pictures) for finger, plan in plans.items()}
    if method != "dots":
        lengths = {
            finger: _as_placed(plans[finger], pictures, own) for finger, own in lengths.items()
        }
    if not any(lengths.values()):
        raise CaptureError(
            f"no hand: in none of {len(pictures)} pictures were two neighbouring joints seen; see "
            "the seeds and the overlay, and that the hand is in view"
        )
    scale = scale_for(wanted, lengths)
    found: dict[Finger, Finding] = {}
    for finger, plan in plans.items():
        palm, side_note = palm_side(plan, pictures, wanted.flexion)
        plan = plan._replace(palm=palm, scale=scale.per_px, scale_sigma=scale.sigma)
        own = [
            *notes.get("", ()),
            *notes.get(finger, ()),
            base_note(plan),
            side_note,
            scale.note,
            _NOTES.get(method, ""),
            *_of_places(plan, pictures[0]),
        ]
        frames = [_frame(plan, seen, lengths[finger]) for seen in pictures]
        bones, sigmas = _bones(plan, lengths[finger])
        recording = GraspRecording(
            subject=wanted.subject,
            finger=finger,
            source=wanted.source,
            method="dots" if method == "dots" else "edges",
            unit="mm" if scale.unit == "mm" else "px",
            lengths=bones,
            lengths_sigma=sigmas,
            notes=[note for note in own if note],
            frames=frames,
        )
        found[finger] = Finding(plan, recording)
    return found


def _plan(finger: Finger, names: Sequence[str], wanted: Wanted) -> FingerPlan:
    """Its joints that were asked for, and the best base line that there is."""
    joints = {joint: name for joint, name in joints_of(finger).items() if name in names}
    if wanted.base is not None:
        return FingerPlan(joints, GIVEN_BASE)
    pairs = [pair for pair in base_places(finger) if set(pair) <= set(names)]
    return FingerPlan(joints, Segment(*pairs[0]) if pairs else None)


def _of_places(plan: FingerPlan, first: Seen) -> list[str]:
    """What the first picture says of this finger's places."""
    return [f"{name}: {note}" for name, note in first.notes if name in plan.joints.values()]


def base_note(plan: FingerPlan) -> str:
    """What the base line is, in words."""
    if plan.base is None:
        return ""
    if plan.base == GIVEN_BASE:
        return "base line: given, at rest in the picture"
    return f"base line: from {plan.base.start} to {plan.base.end}"


def median_lengths(plan: FingerPlan, pictures: Sequence[Seen]) -> dict[Joint, Length]:
    """Each phalanx that was seen at least once."""
    seen: dict[Joint, list[float]] = {}
    for picture in pictures:
        for joint, length in lengths_px(plan, picture.places).items():
            seen.setdefault(joint, []).append(length)
    found: dict[Joint, Length] = {}
    for joint, values in seen.items():
        middle = float(np.median(values))
        spread = _SIGMA_PER_MAD * float(np.median(np.abs(np.array(values) - middle)))
        found[joint] = (middle, spread)
    return found


def _as_placed(
    plan: FingerPlan, pictures: Sequence[Seen], lengths: Mapping[Joint, Length]
) -> dict[Joint, Length]:
    """Edges have one length for all pictures, which spread says nothing of: it is as sure as its
    two ends are, in the unit of their places.
    """
    found: dict[Joint, Length] = {}
    for joint, (length, spread) in lengths.items():
        _, (start, end) = segments_of(plan)[joint]
        ends = [
            float(np.hypot(seen.places[start].sigma_px, seen.places[end].sigma_px))
            for seen in pictures
            if start in seen.places and end in seen.places
        ]
        found[joint] = (length, float(np.hypot(spread, np.median(ends))))
    return found


def scale_for(wanted: Wanted, lengths: Mapping[Finger, Mapping[Joint, Length]]) -> Scale:
    """Millimetres per px by what was given; raises CaptureError where that cannot be."""
    measured = {
        (finger, joint): length for finger, own in lengths.items() for joint, length in own.items()
    }
    if wanted.mm_per_px is not None:
        bones = {BONES[joint]: length for (_, joint), (length, _) in measured.items()}
        return known_scale(wanted.mm_per_px, bones)
    if wanted.lengths_mm:
        return scale_of_lengths(wanted.lengths_mm, measured)
    return NO_SCALE


def palm_side(plan: FingerPlan, pictures: Sequence[Seen], flexion: Flexion) -> tuple[int, str]:
    """+1 where flexion turns clockwise on the screen, else -1; and a note how that was known.

    Fingers flex by up to 110 degrees and extend by 20 at most: what PIP and DIP (of the thumb: its
    IP joint) turn through over all pictures says which side the palm is on.
    """
    if flexion != "auto":
        return (1 if flexion == "clockwise" else -1), f"flexion {flexion}, as given"
    pairs = [
        (before, after)
        for joint, (before, after) in segments_of(plan).items()
        if before is not None and joint != "mcp"
    ]
    turns = [turn(*pair, seen.places) for seen in pictures for pair in pairs]
    known = [one for one in turns if one is not None]
    total = sum(one.angle_rad for one in known)
    side = 1 if total >= 0.0 else -1
    words = "clockwise" if side > 0 else "counterclockwise"
    # A mean turn below three of its sigmas may be either way.
    sure = known and abs(total) > 3.0 * sum(one.sigma_rad for one in known)
    doubt = "" if sure else "; the finger hardly bends, so that may be wrong: say it by --flexion"
    return side, f"flexion is {words} on the screen{doubt}"


def _frame(plan: FingerPlan, seen: Seen, lengths: Mapping[Joint, Length]) -> GraspFrame:
    """One picture's finger, doubted where a phalanx is not as long as it should be."""
    frame = measured_frame(plan, seen)
    doubts = []
    for joint, length in lengths_px(plan, seen.places).items():
        change = length / lengths[joint][0] - 1.0
        if abs(change) > _LENGTH_TOLERANCE:
            doubts.append(f"the {BONES[joint]} phalanx looks {100 * change:+.0f} % long")
    if not doubts:
        return frame
    return msgspec.structs.replace(
        frame,
        confidence=round(_DOUBTFUL * frame.confidence, 3),
        note="; ".join([note for note in (frame.note, *doubts) if note]),
    )


def _bones(
    plan: FingerPlan, lengths: Mapping[Joint, Length]
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float] | None]:
    """Proximal, middle and distal phalanx in the recording's unit, and their sigmas.

    Nothing where one was never seen.
    """
    if any(joint not in lengths for joint in BONES):
        return None, None
    middle, sigma = zip(*(lengths[joint] for joint in BONES), strict=True)
    scaled = [round(plan.scale * length, 4) for length in middle]
    sigmas = [
        round(plan.scale * float(np.hypot(own, plan.scale_sigma * length)), 4)
        for own, length in zip(sigma, middle, strict=True)
    ]
    return (scaled[0], scaled[1], scaled[2]), (sigmas[0], sigmas[1], sigmas[2])
