"""What `rhot top` shows, as lines that fit a screen. Pure.

Where the time of a pose goes and a line per object come first; then faults with what to do, errors
before warnings, then a line per service, then what else there is room for. What does not fit is
counted.
"""

from __future__ import annotations

import time

from rhot import topics
from rhot.messages.health import StreamHealth
from rhot.plain_text import clipped
from rhot.watch.rig_state import Ages, RigState, ServiceRow, StandingFault
from services.cli.live.top_objects import object_lines

_HEADER = f"{'service':<18} {'state':<9} {'up':>6} {'cpu%':>5} {'MB':>4} {'Hz':>6} {'of':>4}"
_HEADER += f" {'markers':>8} {'age ms':>7} {'lost':>4}"


def screen(state: RigState, width: int, height: int | None) -> list[str]:
    """At most height lines of at most width columns; None: as many as there is to say."""
    head = [_title(state), *(_ages(one) for one in state.ages), *object_lines(state, height)]
    faults = [_fault(one) for one in state.faults]
    services = [_service(state, row) for row in _order(state, height)]
    streams = [
        _stream(s) for row in state.services for s in (row.health.streams if row.health else [])
    ]
    if height is None:
        lines = [*head, *(line for two in faults for line in two), _HEADER, *services, *streams]
        return [clipped(line, width).rstrip() for line in lines]
    room = height - len(head) - 1
    # Faults leave half the room to the services where both do not fit.
    told = _fitting(faults, max(room - len(services), room // 2))
    rows = _cut(services, room - len(told), "more services")
    left = room - len(told) - len(rows)
    lines = [
        *head,
        *told,
        _HEADER,
        *rows,
        *(_cut(streams, left, "more streams") if left > 1 else []),
    ]
    return [clipped(line, width).rstrip() for line in lines[:height]]


def _order(state: RigState, height: int | None) -> list[ServiceRow]:
    """The services; where not all may fit, those that do not run first."""
    fits = height is None or len(state.services) + 2 * len(state.faults) + 4 <= height
    rows = state.services
    return rows if fits else sorted(rows, key=lambda row: row.state == "running")


def _fitting(faults: list[tuple[str, str]], room: int) -> list[str]:
    """Faults in two lines each, or in one where that lets more be seen; the rest is counted."""
    if 2 * len(faults) <= room:
        return [line for two in faults for line in two]
    # The first is what one mends first: it keeps its second line.
    lines = [*faults[0], *(text for text, _ in faults[1:])]
    return _cut(lines, room, "more faults")


def _cut(lines: list[str], room: int, more: str) -> list[str]:
    """The first lines, the last of them counting the rest where not all fit."""
    if len(lines) <= room:
        return lines
    shown = max(room - 1, 0)
    return [*lines[:shown], f"... {len(lines) - shown} {more}"][: max(room, 0)]


def _title(state: RigState) -> str:
    errors, warnings = state.errors, len(state.faults) - state.errors
    wrong = "all is well" if state.healthy and not warnings else _counted(errors, warnings)
    at = time.strftime("%H:%M:%S", time.localtime(state.stamp_ns * 1e-9))
    lost = "" if state.connection == "ok" else "  NO ROUTER"
    return f"rig {state.rig}  {at}  {len(state.services)} services  {wrong}{lost}"


def _counted(errors: int, warnings: int) -> str:
    if not errors and not warnings:
        return "something is slow or not running"
    return f"{errors} error{'s' * (errors != 1)}, {warnings} warning{'s' * (warnings != 1)}"


def _ages(ages: Ages) -> str:
    return (
        f"{ages.hand} hand: tracker {ages.tracker_ms:.1f} + fusion {ages.fusion_ms:.1f} + "
        f"solver {ages.solver_ms:.1f} = {ages.pose_ms:.1f} ms glass to pose "
        f"(p99 {ages.pose_p99_ms:.1f})"
    )


def _fault(one: StandingFault) -> tuple[str, str]:
    fault = one.fault
    teller = f"{one.teller}: " if one.teller else ""
    return (
        f"{fault.severity.upper():<7} {teller}{fault.text} [{fault.code}]",
        f"        -> {fault.action}",
    )


def _service(state: RigState, row: ServiceRow) -> str:
    begin = f"{clipped(row.name, 18):<18} {clipped(row.state, 9):<9}"
    health = row.health
    if health is None:
        return begin
    main = _main_stream(health.streams)
    rate = age = ""
    if main is not None:
        rate = f"{'' if main.ok else '!'}{_figure(main.rate_hz, 1)}"
        age = _figure(main.latency_p50_ms, 1) if main.latency_p50_ms >= 0.0 else ""
    of = _figure(main.expected_hz, 0) if main and main.expected_hz else ""
    lost = sum(stream.dropped + stream.rejected for stream in health.streams)
    return (
        f"{begin} {_duration(health.uptime_s):>6} {_figure(health.cpu_percent, 0):>5} "
        f"{_figure(health.rss_mb, 0):>4} {rate:>6} {of:>4} {_markers(state, row):>8} {age:>7} "
        f"{_figure(lost, 0) if lost else '':>4}"
    )


def _main_stream(streams: list[StreamHealth]) -> StreamHealth | None:
    """Of what a service publishes with an expected rate, the stream that is furthest below it."""
    sent = [stream for stream in streams if stream.direction == "out" and stream.expected_hz > 0.0]
    return min(sent, key=lambda stream: stream.rate_hz / stream.expected_hz, default=None)


def _markers(state: RigState, row: ServiceRow) -> str:
    if row.service != "pi_tracker":
        return ""
    for camera in state.cameras:
        if camera.camera == row.instance:
            seen = "-" if camera.markers < 0 else str(camera.markers)
            return f"{seen} of {camera.expected_markers}"
    return ""


def _stream(stream: StreamHealth) -> str:
    topic = topics.find(stream.key)
    key = stream.key.split("/", 2)[-1] if topic or "*" in stream.key else stream.key
    of = f" of {_figure(stream.expected_hz, 0)}" if stream.expected_hz else ""
    latency = ""
    if stream.latency_p50_ms >= 0.0:
        kind = "age" if stream.direction == "out" else "hop"
        p50, p99 = _figure(stream.latency_p50_ms, 1), _figure(stream.latency_p99_ms, 1)
        latency = f"{kind} {p50} p99 {p99} ms"
    lost = ""
    if stream.dropped or stream.rejected:
        lost = f"dropped {stream.dropped} rejected {stream.rejected}"
    rate = f"{_figure(stream.rate_hz, 1)} Hz{of}"
    flag = " " if stream.ok else "!"
    return f" {flag} {stream.direction:<3} {clipped(key, 28):<28} {rate:<14} {latency:<24} {lost}"


def _figure(value: float, digits: int) -> str:
    """A number from the network in a column: huge ones would push the others out of theirs."""
    return f"{min(value, 99999.0):.{digits}f}"


def _duration(seconds: float) -> str:
    """`59s`, `12m`, `3h05`, `40d`."""
    minutes = int(min(seconds, 1e9) // 60)
    if seconds < 60.0:
        return f"{seconds:.0f}s"
    if minutes < 60:
        return f"{minutes}m"
    return f"{minutes // 60}h{minutes % 60:02d}" if minutes < 24 * 60 else f"{minutes // 1440}d"
