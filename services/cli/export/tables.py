"""What `rhot export` writes: which tables, their columns and the rows of a message. Pure.

Units are in the names of the columns: s, mm, deg, px. Every table begins with `time_s`, seconds
since the recording's first message, and ends with `stamp_ns`, the same instant on the master's
clock (nanoseconds since 1970, UTC), by which tables and recordings are joined.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from rhot import topics
from rhot.messages import FingerPose, HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectContacts, ObjectPose

# A row's cells; None where nothing is known.
Row = tuple[Any, ...]
Column = tuple[str, type]
# Digits that are written: micrometres, thousandths of a degree, hundredths of a millisecond.
_MM, _DEG, _S, _PX, _TURN_DIGITS = 3, 3, 5, 3, 6
_DIGIT_ANGLES = {"thumb": ("abduction", "cmc", "mcp", "dip")}
_FINGER_ANGLES = ("abduction", "mcp", "pip", "dip")
_DIGITS = ("thumb", "index", "middle", "ring", "little")


@dataclass(frozen=True)
class Table:
    """One flat table: stream is the file of a result folder that holds its messages."""

    name: str
    stream: str
    topic: topics.Topic[Any]
    kind: type[Any]
    columns: tuple[Column, ...]
    rows: Callable[[Any, int], Iterator[Row]]


def _time(stamp_ns: int, origin_ns: int) -> float:
    return round((stamp_ns - origin_ns) * 1e-9, _S)


def _mm(length_m: float | None) -> float | None:
    return None if length_m is None else round(1e3 * length_m, _MM)


def _deg(angle_rad: float | None) -> float | None:
    return None if angle_rad is None else round(math.degrees(angle_rad), _DEG)


def _xyz_mm(vector_m: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = vector_m
    return round(1e3 * x, _MM), round(1e3 * y, _MM), round(1e3 * z, _MM)


def _wxyz(turn: tuple[float, float, float, float]) -> Row:
    return tuple([round(value, _TURN_DIGITS) for value in turn])


def _markers(frame: MarkerFrame, origin_ns: int) -> Iterator[Row]:
    """Each marker has its own instant: a rolling shutter exposes one row after the other."""
    for marker in frame.markers:
        stamp_ns = frame.stamp_ns + round(marker.y_px * frame.row_time_ns) - frame.clock_offset_ns
        yield (
            _time(stamp_ns, origin_ns),
            frame.camera,
            frame.seq,
            marker.color,
            round(marker.x_px, _PX),
            round(marker.y_px, _PX),
            round(marker.sigma_px, _PX),
            round(marker.area_px, 1),
            round(marker.quality, 3),
            stamp_ns,
        )


def _points(message: HandPoints, origin_ns: int) -> Iterator[Row]:
    for point in message.points:
        yield (
            _time(message.stamp_ns, origin_ns),
            message.hand,
            point.name,
            *_xyz_mm(point.position_m),
            *_xyz_mm(point.sigma_m),
            point.source,
            " ".join(point.cameras),
            message.stamp_ns,
        )


def _poses(pose: HandPose, origin_ns: int) -> Iterator[Row]:
    time_s = _time(pose.stamp_ns, origin_ns)
    for joint in pose.joints:
        yield (
            time_s,
            pose.hand,
            joint.name,
            *_xyz_mm(joint.position_m),
            *_wxyz(joint.orientation_wxyz),
            _mm(joint.radius_m),
            joint.source,
            pose.stamp_ns,
        )


def _angles(pose: HandPose, origin_ns: int) -> Iterator[Row]:
    """One row an instant: all angles, and per digit how sure they are and what is left."""
    cells: list[Any] = [_time(pose.stamp_ns, origin_ns), pose.hand]
    by_name: dict[str, FingerPose] = {finger.name: finger for finger in pose.fingers}
    for digit in _DIGITS:
        finger = by_name.get(digit)
        if finger is None:
            cells += [None] * 7
            continue
        cells += [_deg(angle) for angle in finger.model_angles_rad]
        cells += [_deg(finger.sigma_rad), _mm(finger.residual_m), finger.status]
    yield (*cells, _mm(pose.wrist_sigma_m), _deg(pose.wrist_sigma_rad), pose.stamp_ns)


def _angle_columns() -> Iterator[Column]:
    for digit in _DIGITS:
        for angle in _DIGIT_ANGLES.get(digit, _FINGER_ANGLES):
            yield f"{digit}_{angle}_deg", float
        yield f"{digit}_sigma_deg", float
        yield f"{digit}_residual_mm", float
        yield f"{digit}_status", str


def _objects(pose: ObjectPose, origin_ns: int) -> Iterator[Row]:
    yield (
        _time(pose.stamp_ns, origin_ns),
        pose.object,
        *_xyz_mm(pose.position_m),
        *_wxyz(pose.orientation_wxyz),
        *_xyz_mm(pose.velocity_m_s),
        *map(_deg, pose.angular_velocity_rad_s),
        _mm(pose.sigma_m),
        _deg(pose.sigma_rad),
        pose.tracking,
        pose.registered,
        pose.stamp_ns,
    )


def _contacts(message: ObjectContacts, origin_ns: int) -> Iterator[Row]:
    holding = {(grasp.hand, part) for grasp in message.grasps for part in grasp.parts}
    for contact in message.contacts:
        yield (
            _time(message.stamp_ns, origin_ns),
            message.object,
            contact.hand,
            contact.part,
            _mm(contact.distance_m),
            _mm(contact.sigma_m),
            *_xyz_mm(contact.point_m),
            contact.touching,
            _time(contact.since_ns, origin_ns) if contact.since_ns else None,
            (contact.hand, contact.part) in holding,
            message.stamp_ns,
        )


def _xyz(unit: str, prefix: str = "") -> tuple[Column, ...]:
    return tuple((f"{prefix}{axis}_{unit}", float) for axis in "xyz")


_TIME, _STAMP = ("time_s", float), ("stamp_ns", int)
_TURN: tuple[Column, ...] = tuple((f"q{part}", float) for part in "wxyz")

TABLES: tuple[Table, ...] = (
    Table(
        "markers",
        "markers",
        topics.MARKERS,
        MarkerFrame,
        (
            _TIME,
            ("camera", str),
            ("frame", int),
            ("color", str),
            ("x_px", float),
            ("y_px", float),
            ("sigma_px", float),
            ("area_px2", float),
            ("quality", float),
            _STAMP,
        ),
        _markers,
    ),
    Table(
        "points",
        "points",
        topics.POINTS,
        HandPoints,
        (
            _TIME,
            ("hand", str),
            ("landmark", str),
            *_xyz("mm"),
            *_xyz("mm", "sigma_"),
            ("source", str),
            ("cameras", str),
            _STAMP,
        ),
        _points,
    ),
    Table(
        "poses",
        "poses",
        topics.POSE,
        HandPose,
        (
            _TIME,
            ("hand", str),
            ("joint", str),
            *_xyz("mm"),
            *_TURN,
            ("radius_mm", float),
            ("source", str),
            _STAMP,
        ),
        _poses,
    ),
    Table(
        "angles",
        "poses",
        topics.POSE,
        HandPose,
        (
            _TIME,
            ("hand", str),
            *_angle_columns(),
            ("wrist_sigma_mm", float),
            ("wrist_sigma_deg", float),
            _STAMP,
        ),
        _angles,
    ),
    Table(
        "objects",
        "objects",
        topics.OBJECT,
        ObjectPose,
        (
            _TIME,
            ("object", str),
            *_xyz("mm"),
            *_TURN,
            *_xyz("mm_s", "velocity_"),
            *_xyz("deg_s", "angular_velocity_"),
            ("sigma_mm", float),
            ("sigma_deg", float),
            ("tracking", str),
            ("registered", bool),
            _STAMP,
        ),
        _objects,
    ),
    Table(
        "contacts",
        "contacts",
        topics.CONTACTS,
        ObjectContacts,
        (
            _TIME,
            ("object", str),
            ("hand", str),
            ("part", str),
            ("distance_mm", float),
            ("sigma_mm", float),
            *_xyz("mm", "surface_"),
            ("touching", bool),
            ("touching_since_s", float),
            ("holding", bool),
            _STAMP,
        ),
        _contacts,
    ),
)
