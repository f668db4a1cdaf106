"""`rhot watch hand/right/pose`: one stream as a table that a person can read, live.

On a terminal the table stays in its place; elsewhere one table follows the other. Streams have no
memory: nothing comes while nobody publishes, and the command then ends with a line that says so.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any

import msgspec
import typer
import uvloop

from rhot import clock, topics
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.health import Health
from rhot.messages.objects import ObjectContacts, ObjectPose
from rhot.plain_text import printable
from rhot.process.event_loop import cancelled_by, stop_on_signals
from rhot.topics import Topic
from rhot.watch.object_words import ADVICE, WORDS, holding, state_of
from services.cli.live.alternate_screen import alternate_screen, size
from services.cli.options import ConnectOption, RunningRigOption
from services.cli.router_session import rig_and_endpoints, router_session

# Quicker than a beat a second, slower than a person reads numbers.
_PERIOD_S = 0.2
# Health comes once a second, everything else more often.
_PATIENCE_S = 5.0
_EXAMPLES = (
    "hand/right/pose, hand/right/points, object/cup/pose, object/cup/contacts, "
    "camera/left/markers, service/fusion/main/health"
)
# Words of a table that are read as numbers; longer ones are stamps.
_NUMBER = re.compile(r"-?[0-9.]{1,9}( deg| mm)?$")
Row = Sequence[str]


def watch(
    stream: Annotated[str, typer.Argument(help=f"the end of its key, e.g. {_EXAMPLES}")],
    config: RunningRigOption = None,
    connect: ConnectOption = None,
    once: Annotated[bool, typer.Option(help="print one table and end")] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="end after so long")] = None,
) -> None:
    """Show one stream as a table, live."""
    rig, endpoints = rig_and_endpoints(config, connect)
    topic, names = _topic(stream)
    uvloop.run(_watch(rig, endpoints, topic, names, 0.0 if once else seconds))


def _topic(stream: str) -> tuple[Topic[Any], dict[str, str]]:
    """The topic and the names of a stream; raises BusError with what there is."""
    topic = topics.find(f"{topics.ROOT}/rig/{stream}")
    if topic is None or topic.message is None or topic.kind is topics.Kind.QUERY:
        there = [one.template for one in topics.TOPICS if one.kind is topics.Kind.STREAM]
        shown = ", ".join(one for one in there if one.partition("/")[0] in ("hand", "object"))
        raise BusError(
            f"{stream!r} is no stream of messages; say one like {_EXAMPLES} ({shown}, ...: "
            "docs/reference/topics.md has all)"
        )
    return topic, topic.names(f"{topics.ROOT}/rig/{stream}") or {}


async def _watch(
    rig: RigConfig,
    endpoints: list[str],
    topic: Topic[Any],
    names: dict[str, str],
    seconds: float | None,
) -> None:
    stopping = stop_on_signals()
    with cancelled_by(stopping):
        async with router_session(rig.rig.name, endpoints) as bus:
            messages = bus.latest(topic, **names)
            loop = asyncio.get_running_loop()
            ends_s = math.inf if seconds is None else loop.time() + seconds
            with _display() as show:
                while True:
                    try:
                        async with asyncio.timeout(_PATIENCE_S):
                            message = await anext(messages)
                    except TimeoutError:
                        key = topic.key(rig.rig.name, **names)
                        raise BusError(
                            f"nothing comes at {key}; `rhot top` shows who is missing"
                        ) from None
                    show(table(message, clock.now_ns()))
                    if loop.time() >= ends_s:
                        return
                    await asyncio.sleep(_PERIOD_S)


@contextlib.contextmanager
def _display() -> Iterator[Callable[[list[str]], None]]:
    """How a table is shown: in its place on a terminal, else one after the other."""
    if not sys.stdout.isatty():
        yield lambda lines: typer.echo("\n".join(lines))
        return
    with alternate_screen() as show:

        def fitted(lines: list[str]) -> None:
            columns, rows = size()
            show([line[:columns] for line in lines[:rows]])

        yield fitted


def table(message: msgspec.Struct, now_ns: int) -> list[str]:
    """The lines of one message; now_ns is the master's clock, as far as this machine knows it."""
    match message:
        case HandPose():
            title, rows = f"{message.hand} hand", _pose(message)
        case HandPoints():
            title, rows = f"{message.hand} hand", _points(message)
        case MarkerFrame():
            title, rows = f"camera {message.camera}", _markers(message)
        case ObjectPose():
            title, rows = message.object, _object(message)
        case ObjectContacts():
            title, rows = f"{message.object}, who touches it", _contacts(message)
        case Health():
            title, rows = f"{message.service}/{message.instance}", _health(message)
        case _:
            title, rows = type(message).__name__, _anything(msgspec.to_builtins(message))
    stamp_ns = getattr(message, "stamp_ns", None)
    age = f", {(now_ns - stamp_ns) * 1e-6:.0f} ms old" if stamp_ns else ""
    return [printable(line) for line in [title + age, *_aligned(rows)]]


def _pose(pose: HandPose) -> list[Row]:
    rows: list[Row] = [("wrist", *_mm(pose.wrist.position_m), "mm"), ()]
    rows.append(("finger", "spread", "mcp", "pip", "dip", "off by", "status"))
    for finger in pose.fingers:
        spread, *flexion = (f"{math.degrees(a):.0f} deg" for a in finger.model_angles_rad)
        off_by = f"{1e3 * finger.residual_m:.1f} mm"
        rows.append((finger.name, spread, *flexion, off_by, finger.status))
    return rows


def _points(points: HandPoints) -> list[Row]:
    rows: list[Row] = [("point", "x", "y", "z mm", "+- mm", "", "", "seen by")]
    rows += [
        (
            point.name,
            *_mm(point.position_m),
            *_mm(point.sigma_m),
            " ".join(point.cameras) or point.source,
        )
        for point in points.points
    ]
    return rows


def _markers(frame: MarkerFrame) -> list[Row]:
    rows: list[Row] = [("colour", "x", "y px", "+- px", "area px", "quality")]
    rows += [
        (
            one.color,
            f"{one.x_px:.2f}",
            f"{one.y_px:.2f}",
            f"{one.sigma_px:.2f}",
            f"{one.area_px:.0f}",
            f"{one.quality:.2f}",
        )
        for one in frame.markers
    ]
    return rows


def _object(pose: ObjectPose) -> list[Row]:
    state = state_of(pose.tracking, pose.registered)
    advice = f"; {ADVICE[state]}" if ADVICE[state] else ""
    rows: list[Row] = [
        ("position", *_mm(pose.position_m), "mm"),
        ("orientation", *(f"{value:.3f}" for value in pose.orientation_wxyz), "wxyz"),
        ("velocity", *_mm(pose.velocity_m_s), "mm/s"),
        ("turns", *(f"{math.degrees(v):.1f}" for v in pose.angular_velocity_rad_s), "deg/s"),
    ]
    if pose.sigma_m is not None:
        turn = "" if pose.sigma_rad is None else f"{math.degrees(pose.sigma_rad):.2f} deg"
        rows.append(("+-", f"{1e3 * pose.sigma_m:.1f} mm", turn))
    return [*rows, ("tracking", f"{WORDS[state]}{advice}"), ("tracker", pose.serial)]


def _contacts(message: ObjectContacts) -> list[Row]:
    """Each part of each hand with its distance; then who holds."""
    rows: list[Row] = [("hand", "part", "off mm", "+- mm", "for s", "")]
    for one in message.contacts:
        lasts = ""
        if one.touching and one.since_ns:
            lasts = f"{(message.stamp_ns - one.since_ns) * 1e-9:.1f}"
        touch = "touches" if one.touching else ""
        rows.append((one.hand, one.part, *_mm((one.distance_m, one.sigma_m)), lasts, touch))
    rows += [(holding(one.hand, message.object, one.parts),) for one in message.grasps]
    return rows


def _health(health: Health) -> list[Row]:
    rows: list[Row] = [
        (health.state, f"for {health.uptime_s:.0f} s, version {health.version}, pid {health.pid}"),
        *(
            (fault.severity, f"{fault.text}; {fault.action} [{fault.code}]")
            for fault in health.faults
        ),
        *((name, f"{value:g}") for name, value in sorted(health.values.items())),
    ]
    for one in health.streams:
        of = f" of {one.expected_hz:g}" if one.expected_hz else ""
        lost = f", {one.dropped} dropped, {one.rejected} rejected"
        rows.append((one.direction, f"{one.key} {one.rate_hz:.1f}{of} Hz{lost}"))
    return rows


def _anything(value: Any, path: str = "") -> list[Row]:
    """The leaves of any other message, each with the way to it."""
    if isinstance(value, dict):
        items = [(f"{path}.{key}".lstrip("."), inner) for key, inner in value.items()]
    elif isinstance(value, list) and any(isinstance(one, dict | list) for one in value):
        items = [(f"{path}[{number}]", inner) for number, inner in enumerate(value)]
    else:
        return [(path, msgspec.json.encode(value).decode())]
    return [row for where, inner in items for row in _anything(inner, where)]


def _mm(values: Sequence[float]) -> list[str]:
    return [f"{1e3 * value:.1f}" for value in values]


def _aligned(rows: Sequence[Row]) -> list[str]:
    """The rows in columns: words to the left, numbers to the right."""
    most = max(map(len, rows))
    widths = [max((len(row[n]) for row in rows if n < len(row)), default=0) for n in range(most)]
    return [
        "  ".join(
            cell.rjust(width) if _NUMBER.match(cell) else cell.ljust(width)
            for cell, width in zip(row, widths, strict=False)
        ).rstrip()
        for row in rows
    ]
