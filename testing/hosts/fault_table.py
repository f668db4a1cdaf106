"""What each planted fault cost, as a table for people and as JSON."""

from __future__ import annotations

from pathlib import Path

import msgspec


class FaultRow(msgspec.Struct, frozen=True, kw_only=True):
    """One fault. Times in seconds: until poses were good again (0: they never were away), and until
    the service was ready again; None where that does not apply or never happened.

    counts_from says what the times count from; wanted_s is the goal of poses_s; restarts counts
    those of systemd on all hosts; wrong_poses those that claimed to be measured and were far from
    the truth; hung says that something did not come back by itself.
    """

    fault: str
    counts_from: str
    poses_s: float | None
    wanted_s: float | None
    service_s: float | None = None
    restarts: int = 0
    wrong_poses: int = 0
    hung: bool = False


class FaultTable(msgspec.Struct, kw_only=True):
    """All faults of a run, and what was left in the end (process ids and commands)."""

    rows: list[FaultRow] = msgspec.field(default_factory=list)
    processes_left: list[str] = msgspec.field(default_factory=list)

    def as_text(self) -> str:
        """The table, and a line that sums it up."""
        head = ("fault", "counted from", "poses", "wanted", "service", "restarts", "wrong")
        lines = [_LINE.format(*head)]
        lines += [_line(row) for row in self.rows]
        hangs = sum(row.hung for row in self.rows)
        slow = [row.fault for row in self.rows if _missed(row)]
        lines.append(
            f"{sum(row.restarts for row in self.rows)} restarts, {hangs} hangs, "
            f"{len(self.processes_left)} processes left; later than wanted: "
            f"{', '.join(slow) or 'nothing'}"
        )
        return "\n".join(lines)

    def write(self, path: Path) -> None:
        """As JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(msgspec.json.format(msgspec.json.encode(self)) + b"\n")


_LINE = "{:44} {:12} {:>8} {:>8} {:>8} {:>8} {:>6}"


def _line(row: FaultRow) -> str:
    poses, wanted, service = (_seconds(s) for s in (row.poses_s, row.wanted_s, row.service_s))
    cells = (row.fault, row.counts_from, poses, wanted, service, row.restarts, row.wrong_poses)
    return _LINE.format(*cells) + ("  HUNG" if row.hung else "")


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} s"


def _missed(row: FaultRow) -> bool:
    return row.wanted_s is not None and (row.poses_s is None or row.poses_s > row.wanted_s)
