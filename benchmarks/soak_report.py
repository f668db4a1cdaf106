"""A soak run as Markdown and as a plot."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from soak_statistics import (
    LIMIT_MB_PER_HOUR,
    Life,
    Run,
    latency_ratio,
    lives,
    quiet_latencies,
    shortfalls,
)

_HEADING = (
    "| process | minutes | MB at the end | gained | of it in one step | MB/h beside it | 95 % "
    "| restarts |"
)


def markdown(run: Run, command: str) -> str:
    """The whole report."""
    first, last, ratio = latency_ratio(run)
    times = [one.recovered_s for one in run.recoveries if one.recovered_s is not None]
    worst = f"{max(times):.1f} s at most, {np.median(times):.1f} s median" if times else "none"
    failed = shortfalls(run)
    lines = [
        "# Soak",
        "",
        (
            f"`{command}`: {run.seconds / 60.0:.1f} minutes, {len(run.latencies)} poses, "
            f"{len(run.recoveries)} faults."
        ),
        "",
        "Result: " + ("; ".join(failed) if failed else "all well") + ".",
        "",
        f"Poses again after a fault: {worst}. Processes left over: {run.left_over}.",
        (
            f"Glass to pose, median: {first:.1f} ms in the first third of the quiet time, "
            f"{last:.1f} ms in the last ({ratio:.2f} times)."
        ),
        "",
        (
            f"Resident memory from {run.warm_s / 60.0:.1f} minutes on, after {run.warm_up_faults} "
            "faults of the same kinds to warm up "
            f"(wanted: less than {LIMIT_MB_PER_HOUR:g} MB/h; a single larger step is no growth "
            "that goes on, and stands beside it):"
        ),
        "",
        _HEADING,
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [_row(one, run.restarts.get(one.process, 0)) for one in lives(run)]
    lines += ["", "| at | fault | poses again after |", "|---|---|---|"]
    lines += [
        f"| {one.at_s:.0f} s | {one.fault} | "
        + ("never" if one.recovered_s is None else f"{one.recovered_s:.2f} s")
        + " |"
        for one in run.recoveries
    ]
    return "\n".join(lines) + "\n"


def _row(life: Life, restarts: int) -> str:
    growth = life.growth
    step = f"{growth.step_mb:+.2f}" if growth.step_mb else ""
    return (
        f"| {life.process} | {life.minutes:.1f} | {life.rss_mb:.1f} | {life.gained_mb:+.2f} | "
        f"{step} | {growth.mb_h:+.2f} | {growth.low_mb_h:+.2f} to {growth.high_mb_h:+.2f} | "
        f"{restarts} |"
    )


def plot(run: Run, path: Path) -> None:
    """Memory of each process and latency over time; faults as lines."""
    figure, (memory, latency) = plt.subplots(2, 1, sharex=True, figsize=(10, 7))
    colors: dict[str, str] = {}
    for (process, _), samples in run.memory.items():
        label = None if process in colors else process
        color = colors.setdefault(process, f"C{len(colors) % 10}")
        minutes, megabytes = zip(*[(s / 60.0, mb) for s, mb in samples], strict=True)
        memory.plot(minutes, megabytes, color=color, label=label)
    memory.set_ylabel("resident memory (MB)")
    memory.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
    times, latencies = quiet_latencies(run)
    latency.plot(times / 60.0, latencies, ".", markersize=1)
    latency.set_ylim(0.0, float(np.percentile(latencies, 99.5)) * 1.2 if len(latencies) else 1.0)
    latency.set_ylabel("glass to pose (ms), faults left out")
    latency.set_xlabel("minutes")
    for axes in (memory, latency):
        for one in run.recoveries:
            axes.axvline(one.at_s / 60.0, color="0.85", linewidth=0.8, zorder=0)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
