"""From joints in pixels to the finger's plane: angles, lengths, points, each with its sigma. Pure.

The paper, section 4: the joint angles are the angular distances between the line segments, "namely
base line segment, MCP-PIP segment (1), PIP-DIP (2) segment and DIP-TIP (3) segment". The camera
looks across the finger's plane (fronto-parallel, as in the paper's Fig. 2), or its picture was
rectified.

Uncertainty, first order: the direction of a segment from a to b turns by n . d / length where d is
an error of b, and by minus that for one of a (n: the unit normal). A joint that two segments share
counts once, with the sum of both.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from studies.grasp.measure.joints import Place, Seen
from studies.grasp.recording import Angle, GraspFrame, Joint

# How sure a base line is that a person gave as two points of the picture: a click's pixel.
CLICK_SIGMA_PX = 1.0
# A segment shorter than this many of its own sigmas has no direction.
_SHORTEST_SIGMAS = 3.0


class Segment(NamedTuple):
    """A line from one place to another, by their names."""

    start: str
    end: str


class FingerPlan(NamedTuple):
    """How a finger's places become a frame of a recording.

    joints: in the finger's order; base: its base line, None without; palm: +1 where flexion turns
    clockwise on the screen, else -1; scale: units of the recording per px, and its relative sigma.
    """

    joints: dict[Joint, str]
    base: Segment | None
    palm: int = 1
    scale: float = 1.0
    scale_sigma: float = 0.0


class Turn(NamedTuple):
    """An angle between two segments, rad, clockwise on the screen; -pi..pi."""

    angle_rad: float
    sigma_rad: float


def label(plan: FingerPlan, joint: Joint) -> str:
    """What people call a joint: of the thumb cmc, mp, ip."""
    return plan.joints[joint].split("_", 1)[1]


def turn(first: Segment, second: Segment, places: dict[str, Place]) -> Turn | None:
    """From the direction of one segment to that of the next; None where a place was not seen."""
    gradients: dict[str, tuple[float, float]] = {}
    angles = []
    for segment, sign in ((first, -1.0), (second, 1.0)):
        if segment.start not in places or segment.end not in places:
            return None
        start, end = places[segment.start], places[segment.end]
        dx, dy = end.x_px - start.x_px, end.y_px - start.y_px
        length = math.hypot(dx, dy)
        if length <= _SHORTEST_SIGMAS * math.hypot(start.sigma_px, end.sigma_px):
            return None
        angles.append(math.atan2(dy, dx))
        # The derivative of the direction by the end: the normal over the length.
        gx, gy = -sign * dy / length**2, sign * dx / length**2
        for name, side in ((segment.end, 1.0), (segment.start, -1.0)):
            x, y = gradients.get(name, (0.0, 0.0))
            gradients[name] = (x + side * gx, y + side * gy)
    variance = sum(
        (x * x + y * y) * places[name].sigma_px ** 2 for name, (x, y) in gradients.items()
    )
    return Turn(wrapped(angles[1] - angles[0]), math.sqrt(variance))


def wrapped(angle_rad: float) -> float:
    """The same angle in -pi..pi."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def segments_of(plan: FingerPlan) -> dict[Joint, tuple[Segment | None, Segment]]:
    """At each joint that bends: the segment before it and the one after it."""
    names = list(plan.joints.items())
    found: dict[Joint, tuple[Segment | None, Segment]] = {}
    before = plan.base
    for (joint, name), (_, following) in pairwise(names):
        after = Segment(name, following)
        found[joint] = (before, after)
        before = after
    return found


def lengths_px(plan: FingerPlan, places: dict[str, Place]) -> dict[Joint, float]:
    """The length of each phalanx that was seen, px, by the joint at its start."""
    found: dict[Joint, float] = {}
    for joint, (_, after) in segments_of(plan).items():
        if after.start in places and after.end in places:
            found[joint] = distance_px(places[after.start], places[after.end])
    return found


def distance_px(a: Place, b: Place) -> float:
    """Between two places."""
    return math.hypot(b.x_px - a.x_px, b.y_px - a.y_px)


def measured_frame(plan: FingerPlan, seen: Seen) -> GraspFrame:
    """One picture's finger; what needs a place that was not seen is left out, with a note."""
    turns = {
        joint: turn(before, after, seen.places)
        for joint, (before, after) in segments_of(plan).items()
        if before is not None
    }
    angles: dict[Angle, float] = {}
    sigmas: dict[Angle, float] = {}
    for joint, found in turns.items():
        if found is not None and joint != "tip":
            angles[joint] = plan.palm * found.angle_rad
            sigmas[joint] = found.sigma_rad
    points, points_sigma = _points(plan, seen.places)
    notes = [
        f"{name}: {seen.lost.get(name, 'not seen')}"
        for name in _needed(plan)
        if name in seen.lost or name not in seen.places
    ]
    present = [seen.places[name].quality for name in _needed(plan) if name in seen.places]
    return GraspFrame(
        frame=seen.frame,
        time_s=round(seen.time_s, 6),
        points=points,
        points_sigma=points_sigma,
        angles_rad={joint: round(angle, 6) for joint, angle in angles.items()},
        angles_sigma_rad={joint: round(sigma, 6) for joint, sigma in sigmas.items()},
        tip_direction_rad=_tip_direction(plan, angles),
        confidence=round(min(present, default=0.0) * len(present) / len(_needed(plan)), 3),
        note="; ".join(notes),
    )


def _needed(plan: FingerPlan) -> list[str]:
    base = [] if plan.base is None else [plan.base.start, plan.base.end]
    return list(dict.fromkeys([*base, *plan.joints.values()]))


def _tip_direction(plan: FingerPlan, angles: dict[Angle, float]) -> float | None:
    """The sum of the angles: beyond pi where a fist closes, so no atan2 of the last segment."""
    bending = [joint for joint in plan.joints if joint != "tip"]
    if plan.base is None or any(joint not in angles for joint in bending):
        return None
    return round(sum(angles.values()), 6)


def _points(
    plan: FingerPlan, places: dict[str, Place]
) -> tuple[dict[Joint, tuple[float, float]], dict[Joint, float]]:
    """The joints in the finger's plane; nothing without base line or MCP joint."""
    origin = places.get(plan.joints.get("mcp", ""))
    if plan.base is None or origin is None or not {*plan.base} <= set(places):
        return {}, {}
    start, end = places[plan.base.start], places[plan.base.end]
    length = distance_px(start, end)
    if length <= 0.0:
        return {}, {}
    x, y = (end.x_px - start.x_px) / length, (end.y_px - start.y_px) / length
    base_sigma = math.hypot(start.sigma_px, end.sigma_px) / length
    points: dict[Joint, tuple[float, float]] = {}
    sigmas: dict[Joint, float] = {}
    for joint, name in plan.joints.items():
        if name not in places:
            continue
        place = places[name]
        dx, dy = place.x_px - origin.x_px, place.y_px - origin.y_px
        along, across = x * dx + y * dy, plan.palm * (x * dy - y * dx)
        points[joint] = (round(plan.scale * along, 4), round(plan.scale * across, 4))
        # Of both axes together: the base line's direction moves a point across its radius only, the
        # scale along it only.
        radius = math.hypot(dx, dy)
        own = place.sigma_px**2 + (origin.sigma_px**2 if joint != "mcp" else 0.0)
        variance = own + 0.5 * radius**2 * (base_sigma**2 + plan.scale_sigma**2)
        sigmas[joint] = round(plan.scale * math.sqrt(variance), 4)
    return points, sigmas
