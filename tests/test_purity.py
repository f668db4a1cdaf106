"""What may touch clocks, sockets and threads, and what a process imports (docs/architecture.md)."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from testing.source_tree import CODE, ROOT, imports_of, keep_to, only_for_types, relative

# Only these may touch the outside world: sockets, threads, clocks, logs.
IMPURE_MODULES = {
    "asyncio",
    "zenoh",
    "logging",
    "time",
    "datetime",
    "uvloop",
    "socket",
    "threading",
    "subprocess",
}
IMPURE_FILES = {
    "service.py",
    "__main__.py",
    "rhot/clock.py",
    "rhot/client.py",
    "rhot/blocking.py",
    "rhot/watch/follow.py",
}
IMPURE_ROOMS = {
    "rhot/bus",
    "rhot/process",
    "services/pi_tracker/endpoints",
    "services/pi_tracker/sources",
    "services/calibrator/endpoints",
    "services/object_tracker/drift.py",
    "services/object_tracker/sources",
    "services/bridges/endpoints",
    "services/bridges/ros2/node.py",
    "services/bridges/websocket/server.py",
    "services/openvr_bridge/endpoints",
    "services/openvr_bridge/sources",
    "services/recorder/sources",
    "services/viewer/calibration/page.py",
    "services/viewer/guide/callbacks.py",
    "services/viewer/guide/captions.py",
    "services/viewer/guide/exposure_step.py",
    "services/viewer/guide/link.py",
    "services/viewer/guide/section.py",
    "services/viewer/pictures/feed.py",
    "services/viewer/server.py",
    "services/viewer/visits/visits.py",
    "services/viewer/recording/link.py",
    "services/viewer/recording/replay_page.py",
    "services/viewer/recording/section.py",
    "services/recorder/endpoints",
    "rhot/watch/follow.py",
    "services/cli",
}
# Rooms of the command that work on files alone: what they find must not depend on when they run.
# (What check asks of this machine and of a running rig, it asks through services/cli/rig.)
PURE_ROOMS = {"services/cli/check", "services/cli/evaluate", "services/cli/offline"}


def may_be_impure(path: Path) -> bool:
    name = relative(path)
    if any(name.startswith(f"{room}/") for room in PURE_ROOMS):
        return False
    return (
        name in IMPURE_FILES
        or path.name in IMPURE_FILES
        or any(name == room or name.startswith(f"{room}/") for room in IMPURE_ROOMS)
    )


def test_pure_modules_stay_pure():
    ours = ("rhot.bus", "rhot.clock.now_ns", "rhot.process.lifecycle", "rhot.process.service")

    def wrong_imports(path: Path) -> Iterator[str]:
        names = imports_of(path) - only_for_types(path)
        impure = {name for name in names if name.split(".")[0] in IMPURE_MODULES}
        impure |= {name for name in names if name.startswith(ours)}
        if impure:
            yield f" imports {sorted(impure)}: time is an argument"

    pure = [path for path in CODE if not may_be_impure(path)]
    assert len(pure) > 100
    keep_to(wrong_imports, pure)


@pytest.mark.parametrize(
    ("module", "forbidden"),
    [
        (
            "services.pi_tracker.service",
            {"scipy", "numba", "viser", "mcap", "typer", "matplotlib", "cryptography"},
        ),
        (
            "services.object_tracker.service",
            {"scipy", "numba", "viser", "cv2", "mcap", "matplotlib"},
        ),
        (
            "services.openvr_bridge.service",
            {"scipy", "numba", "viser", "cv2", "mcap", "typer", "matplotlib", "uvloop", "resource"},
        ),
        # numba imports scipy, but none of its parts: half a second for which poses would be gone
        # when a simulator is started anew.
        (
            "services.simulator.service",
            {"scipy.interpolate", "scipy.linalg", "viser", "mcap", "typer", "cryptography"},
        ),
        (
            "rhot.client",
            {"scipy", "numba", "viser", "cv2", "mcap", "typer", "matplotlib"},
        ),
        ("services.cli.application", {"scipy", "numba", "viser", "cv2", "matplotlib"}),
    ],
)
def test_a_process_imports_only_what_it_needs(module, forbidden):
    script = f"import sys, {module}; print(*sys.modules)"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60, cwd=ROOT)
    assert not forbidden & set(done.stdout.split())
