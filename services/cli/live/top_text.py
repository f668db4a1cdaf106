"""The table of `rhot top` as text: a line per service, and below it one per stream.

A stream below its expected rate is marked with `!`. Its latency is the age of the content where it
is published (`age`), or the time since it was sent where it is received (`hop`).
"""

from __future__ import annotations

from rhot.health_messages import StreamHealth
from services.cli.live.top_table import ServiceRow, TopTable


def table_text(table: TopTable) -> str:
    """The whole table."""
    lines = [
        f"rig {table.rig}",
        f"{'service':<24} {'state':<10} {'up s':>7} {'cpu %':>6} {'MB':>6} {'errors':>6}",
    ]
    for row in table.services:
        lines.append(_service_line(row))
        lines += [_stream_line(stream) for stream in (row.health.streams if row.health else [])]
        if row.health and row.health.last_error:
            lines.append(f"    last error: {row.health.last_error}")
    for hand, (p50_ms, p99_ms) in table.glass_to_pose_ms.items():
        lines.append(f"glass to {hand} pose: p50 {p50_ms:.1f} ms, p99 {p99_ms:.1f} ms")
    return "\n".join(lines)


def _service_line(row: ServiceRow) -> str:
    name = f"{row.service}/{row.instance}"
    if row.health is None:
        return f"{name:<24} {row.state:<10}"
    load = f"{row.health.cpu_percent:>6.1f} {row.health.rss_mb:>6.0f} {row.health.errors:>6}"
    return f"{name:<24} {row.state:<10} {row.health.uptime_s:>7.0f} {load}"


def _stream_line(stream: StreamHealth) -> str:
    flag = " " if stream.ok else "!"
    key = stream.key.split("/", 2)[-1]
    rate = f"{stream.rate_hz:6.1f} Hz"
    if stream.expected_hz:
        rate += f" of {stream.expected_hz:g}"
    latency = ""
    if stream.latency_p50_ms >= 0.0:
        kind = "age" if stream.direction == "out" else "hop"
        latency = f"{kind} p50 {stream.latency_p50_ms:.1f} p99 {stream.latency_p99_ms:.1f} ms"
    losses = ""
    if stream.dropped or stream.rejected:
        losses = f"dropped {stream.dropped} rejected {stream.rejected}"
    return f"  {flag} {stream.direction:<3} {key:<32} {rate:<18} {latency:<30} {losses}".rstrip()
