"""The time from glass to pose, split by stage, from the services' health. Pure.

Every stream tells the age of what it carries when it is published: the time since mid-exposure. The
difference of two neighbours is what the stage between them took, its network included, and so the
parts add up.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rhot import topics
from rhot.hand import HANDS
from rhot.messages.health import Health, StreamHealth
from rhot.topics import Topic
from rhot.watch.rig_state import Ages


def ages_of(beats: Iterable[Health]) -> list[Ages]:
    """For each hand that has poses; a stage without a figure counts with the next one."""
    beats = list(beats)
    markers_ms = [stream.latency_p50_ms for _, stream in _published(beats, topics.MARKERS)]
    points_ms = {
        names["hand"]: stream.latency_p50_ms for names, stream in _published(beats, topics.POINTS)
    }
    found: dict[str, Ages] = {}
    for names, stream in _published(beats, topics.POSE):
        # Of a hand that two publish one figure is enough: that there are two is its own fault.
        if names["hand"] in found or names["hand"] not in HANDS:
            continue
        pose_ms = stream.latency_p50_ms
        # The figures are of each service's own last seconds: on a computer that stutters what lies
        # behind may seem younger than what it is made of. No stage took less than nothing.
        until_points_ms = min(points_ms.get(names["hand"], 0.0), pose_ms)
        # Points are due with the frames of one camera, of the first to arrive.
        until_markers_ms = min(markers_ms, default=0.0)
        until_markers_ms = min(until_markers_ms, until_points_ms or pose_ms)
        found[names["hand"]] = Ages(
            hand=names["hand"],
            tracker_ms=round(until_markers_ms, 3),
            fusion_ms=round(until_points_ms - until_markers_ms, 3) if until_points_ms else 0.0,
            solver_ms=round(pose_ms - (until_points_ms or until_markers_ms), 3),
            pose_ms=pose_ms,
            pose_p99_ms=stream.latency_p99_ms,
        )
    return list(found.values())


def _published(
    beats: Iterable[Health], topic: Topic
) -> Iterator[tuple[dict[str, str], StreamHealth]]:
    """Streams of that topic that somebody publishes, with an age, and the names in their keys."""
    for health in beats:
        for stream in health.streams:
            names = topic.names(stream.key)
            if stream.direction == "out" and names and stream.latency_p50_ms >= 0.0:
                yield names, stream
