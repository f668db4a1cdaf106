"""What a soak run measured, and what it says: growth of memory, flatness of latency, recoveries.

Pure; times are seconds since the run began.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from testing.memory_growth import Growth, memory_growth

# A process fills its caches in its first minute, and when it first meets a fault of each kind; what
# it grows by later would go on growing.
WARM_UP_S = 60.0
# Growth needs a stretch of time: over less, steps of a heap are all one sees.
SHORTEST_S = 300.0
# After a fault the latency is that of a rig that finds itself again.
SETTLE_S = 10.0
LIMIT_MB_PER_HOUR, LIMIT_LATENCY_RATIO = 1.0, 1.25


@dataclass
class Recovery:
    """One fault: when, what, and how long after its end poses came again (None: not at all)."""

    at_s: float
    fault: str
    recovered_s: float | None = None


@dataclass
class Run:
    """Everything that was measured."""

    # (process, pid) -> samples of (time in s, resident memory in MB)
    memory: dict[tuple[str, int], list[tuple[float, float]]] = field(default_factory=dict)
    # (time in s, glass-to-pose in ms)
    latencies: list[tuple[float, float]] = field(default_factory=list)
    recoveries: list[Recovery] = field(default_factory=list)
    restarts: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    # When every kind of fault had been met.
    warm_s: float = 0.0
    # How many faults, that end no process, had come until then.
    warm_up_faults: int = 0
    left_over: int = 0


@dataclass(frozen=True)
class Life:
    """Memory of one process over its longest life: minutes, MB at its end, what it gained."""

    process: str
    minutes: float
    rss_mb: float
    gained_mb: float
    growth: Growth


def lives(run: Run) -> list[Life]:
    """The longest life of each process, if it was long enough to tell."""
    longest: dict[str, list[tuple[float, float]]] = {}
    for (process, _), samples in run.memory.items():
        from_s = max(run.warm_s, samples[0][0] + WARM_UP_S)
        warm = [sample for sample in samples if sample[0] >= from_s]
        if len(warm) > len(longest.get(process, [])):
            longest[process] = warm
    found = []
    for process, samples in sorted(longest.items()):
        times_s, megabytes = (np.array(column) for column in zip(*samples, strict=True))
        span_s = times_s[-1] - times_s[0]
        if span_s >= SHORTEST_S:
            growth = memory_growth(times_s, megabytes, LIMIT_MB_PER_HOUR)
            gained_mb = float(megabytes[-1] - megabytes[0])
            found.append(Life(process, span_s / 60.0, float(megabytes[-1]), gained_mb, growth))
    return found


def quiet_latencies(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) in s and latencies (n,) in ms of warmed-up poses that no fault was near."""
    times, latencies = (np.array(column) for column in zip(*run.latencies, strict=True))
    quiet = times > max(WARM_UP_S, run.warm_s)
    for one in run.recoveries:
        until_s = one.at_s + (one.recovered_s or 0.0) + SETTLE_S
        quiet &= (times < one.at_s - 1.0) | (times > until_s)
    return times[quiet], latencies[quiet]


def latency_ratio(run: Run) -> tuple[float, float, float]:
    """Median latency in ms in the first and in the last third of the quiet time; last / first."""
    _, latencies = quiet_latencies(run)
    third = len(latencies) // 3
    if third < 100:
        return float("nan"), float("nan"), float("nan")
    first, last = float(np.median(latencies[:third])), float(np.median(latencies[-third:]))
    return first, last, last / first


def shortfalls(run: Run) -> list[str]:
    """What this run did not meet; empty if all is well."""
    found = [
        f"{life.process} grows by {life.growth.mb_h:.2f} MB/h"
        for life in lives(run)
        # The lower end: a slope that noise alone can make is no growth.
        if life.growth.mb_h > LIMIT_MB_PER_HOUR and life.growth.low_mb_h > 0.0
    ]
    found += [
        f"no pose after {one.fault} at {one.at_s:.0f} s"
        for one in run.recoveries
        if one.recovered_s is None
    ]
    ratio = latency_ratio(run)[2]
    if ratio > LIMIT_LATENCY_RATIO:
        found.append(f"latency at the end is {ratio:.2f} times that of the beginning")
    if run.left_over:
        found.append(f"{run.left_over} processes were left over")
    return found
