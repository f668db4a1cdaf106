"""Poses as they arrive during a test, and how long they were away after a fault."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Of six markers: a finger may hide behind another, a camera that is gone takes all of them.
ENOUGH_MEASURED = 4
# At 15 poses a second three in a row may miss a marker; what lasts longer is an interruption.
GAP_S = 0.3
# The watch tells of a pose when it has compared it with the truth (pose_watch.py), and this machine
# may be busy.
_TOLD_LATE_S = 0.25 + 0.25
# A pose that is older than this when it arrives helps nobody.
_MAX_AGE_S = 0.5
# Wrist and tips from this rig's small pictures are within 30 mm of the truth; a camera's clock that
# is a tenth of a second off makes it decimetres.
WRONG_M = 0.1


@dataclass(frozen=True)
class SeenPose:
    """One pose: when it came (CLOCK_MONOTONIC), how old it was, how many joints were measured, and
    its largest distance from the truth (None: the truth of its instant is unknown).
    """

    at_s: float
    age_s: float
    measured: int
    error_m: float | None

    @property
    def live(self) -> bool:
        """Whether it claims to tell where the hand is now."""
        return self.measured >= ENOUGH_MEASURED and -_MAX_AGE_S < self.age_s < _MAX_AGE_S

    @property
    def wrong(self) -> bool:
        """Whether it is far from the truth."""
        return self.error_m is not None and self.error_m > WRONG_M

    @property
    def good(self) -> bool:
        """Whether it tells where the hand is now."""
        return self.live and not self.wrong


def back_at_s(
    poses: Sequence[SeenPose], fault_s: float, now_s: float, calm_s: float
) -> float | None:
    """When good poses came again after a fault, and have come without a gap for calm_s since.

    poses are those since the fault. The result is fault_s itself if they were never away for longer
    than GAP_S; None if they are not back yet.
    """
    back_s = last_s = fault_s
    for at_s in (pose.at_s for pose in poses if pose.good):
        if at_s - last_s > GAP_S:
            back_s = at_s
        last_s = at_s
    calm = now_s - last_s <= GAP_S + _TOLD_LATE_S and last_s - back_s >= calm_s - GAP_S
    return back_s if calm else None


class PoseWatch:
    """The watching process in a host's network, and what it has seen."""

    def __init__(self, namespace: Path, rig: str, endpoint: str) -> None:
        self.poses: list[SeenPose] = []
        # (service, instance) -> (when it came, Health)
        self.health: dict[tuple[str, str], tuple[float, dict[str, Any]]] = {}
        root = Path(__file__).parents[2]
        words = (sys.executable, "-m", "testing.hosts.pose_watch", rig, endpoint)
        self._process = subprocess.Popen(
            ["nsenter", f"--net={namespace}", "--", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            cwd=root,
            env=os.environ | {"PYTHONPATH": str(root)},
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            seen = json.loads(line)
            if (health := seen.get("health")) is not None:
                self.health[health["service"], health["instance"]] = (seen["at_s"], health)
            else:
                error_m = seen["error_m"]
                pose = SeenPose(seen["at_s"], seen["age_s"], seen["measured"], error_m)
                self.poses.append(pose)

    def since(self, instant_s: float) -> list[SeenPose]:
        """Poses that came after an instant of CLOCK_MONOTONIC."""
        return [pose for pose in list(self.poses) if pose.at_s >= instant_s]

    def wait_first(self, timeout_s: float) -> float | None:
        """Wait for two seconds of good poses; when they began, None if that does not happen."""
        return self.wait_back(time.monotonic(), timeout_s)

    def wait_back(self, fault_s: float, timeout_s: float, calm_s: float = 2.0) -> float | None:
        """Wait until poses are back, as back_at_s() has it; None if they are not in time."""
        deadline_s = time.monotonic() + timeout_s
        while (now_s := time.monotonic()) < deadline_s:
            back_s = back_at_s(self.since(fault_s), fault_s, now_s, calm_s)
            if back_s is not None:
                return back_s
            time.sleep(0.05)
        return None

    def wait_fault(self, service: str, code: str, timeout_s: float) -> bool:
        """Wait until a service's health names a fault."""
        return self._wait_health(
            service,
            lambda health: any(fault["code"] == code for fault in health["faults"]),
            timeout_s,
        )

    def wait_value(self, service: str, name: str, value: float, timeout_s: float) -> bool:
        """Wait until a figure of a service's health has a value."""
        return self._wait_health(
            service, lambda health: health["values"].get(name) == value, timeout_s
        )

    def _wait_health(
        self, service: str, condition: Callable[[dict[str, Any]], bool], timeout_s: float
    ) -> bool:
        since_s = time.monotonic()
        while time.monotonic() < since_s + timeout_s:
            for (name, _), (at_s, health) in list(self.health.items()):
                if name == service and at_s >= since_s and condition(health):
                    return True
            time.sleep(0.1)
        return False

    def close(self) -> None:
        """End the watching process."""
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(5.0)
        if self._process.stdout is not None:
            self._process.stdout.close()


@contextlib.contextmanager
def watching(namespace: Path, rig: str, endpoint: str) -> Iterator[PoseWatch]:
    """A watch for as long as the block lasts."""
    watch = PoseWatch(namespace, rig, endpoint)
    try:
        yield watch
    finally:
        watch.close()
