"""What `rhot demo` reports at its end, as a message and as text."""

from __future__ import annotations

import msgspec

from services.cli.demo.object_metrics import ObjectSummary, object_text


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """The measurements of one run; None where nothing was measured."""

    seconds: float
    poses: int
    poses_per_s: float
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    tip_error_rms_mm: float | None
    tip_error_median_mm: float | None
    object_poses: int
    objects: dict[str, ObjectSummary]
    restarts: dict[str, int]


def summary_text(summary: Summary) -> str:
    """A few lines for people."""
    rate = f"{summary.seconds:.1f} s = {summary.poses_per_s:.1f} per second"
    p50, p99 = _value(summary.latency_p50_ms, "ms"), _value(summary.latency_p99_ms, "ms")
    rms = _value(summary.tip_error_rms_mm, "mm")
    median = _value(summary.tip_error_median_mm, "mm")
    lines = [
        f"poses        {summary.poses} in {rate}",
        f"latency      p50 {p50}, p99 {p99} (mid-exposure to pose received)",
        f"tip error    RMS {rms}, median {median} against the truth",
        f"object poses {summary.object_poses}",
        *(object_text(name, one) for name, one in summary.objects.items()),
    ]
    lines += [f"restarts     {name}: {count}" for name, count in sorted(summary.restarts.items())]
    return "\n".join(lines)


def _value(value: float | None, unit: str) -> str:
    return "not measured" if value is None else f"{value:.1f} {unit}"
