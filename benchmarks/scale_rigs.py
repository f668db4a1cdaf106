"""The machine of benchmarks/scale.py: routers, one fusion, which solves as well, for all rigs."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from latency_rig import RIG, write_rig

from testing.loopback import free_endpoint
from testing.synthetic_points import SyntheticRig

_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE_MB = os.sysconf("SC_PAGE_SIZE") / 1e6
_START_S = 30.0


def rig_name(n: int) -> str:
    """[rig] name of rig n."""
    return f"room{n}"


class Machine:
    """What runs, and what it uses."""

    def __init__(self, endpoints: list[str]) -> None:
        self.endpoints = endpoints
        self.processes: dict[str, list[int]] = {}
        self._began_s, self._before = 0.0, dict[str, float]()

    def begin(self) -> None:
        """What was used until now does not count."""
        self._began_s = time.monotonic()
        self._before = {name: self._cpu_s(name) for name in self.processes}

    def elapsed_s(self) -> float:
        """Since begin()."""
        return time.monotonic() - self._began_s

    def cores(self) -> dict[str, float]:
        """Share of a core by kind of process, since begin()."""
        elapsed_s = self.elapsed_s()
        return {name: (self._cpu_s(name) - self._before[name]) / elapsed_s for name in self._before}

    def memory_mb(self, name: str) -> float:
        """Resident memory of a kind of process now."""
        return sum(
            int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE_MB
            for pid in self._all(name)
        )

    def _all(self, name: str) -> list[int]:
        """The processes of a kind, and those that serve shares of their rigs."""
        own = self.processes[name]
        return own + [
            int(child)
            for pid in own
            for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        ]

    def _cpu_s(self, name: str) -> float:
        used = 0
        for pid in self._all(name):
            # After the name in parentheses, which may have blanks: utime and stime are 14 and 15.
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            used += int(fields[11]) + int(fields[12])
        return used / _TICKS


@contextlib.contextmanager
def running(
    folder: Path, rig: SyntheticRig, rigs: int, routers: int, *, one_process: bool, apart: bool
) -> Iterator[Machine]:
    """All processes; the rigs take turns with the routers. one_process: of fusion; apart: the
    solver has its own.
    """
    machine = Machine([free_endpoint() for _ in range(routers)])
    configs = folder / "rigs"
    configs.mkdir()
    for n in range(rigs):
        own = folder / rig_name(n)
        own.mkdir()
        text = write_rig(own, rig).read_text()
        connect = machine.endpoints[n % routers]
        (configs / f"{rig_name(n)}.toml").write_text(
            text.replace(
                f'name = "{RIG}"', f'name = "{rig_name(n)}"\ncalibration = "{own / "calibration"}"'
            )
            + f'[bus]\nconnect = ["{connect}"]\n'
        )
    with contextlib.ExitStack() as stack:
        log = stack.enter_context((folder / "log").open("wb"))

        def start(name: str, *arguments: str) -> None:
            process = subprocess.Popen(
                [sys.executable, "-m", *arguments],
                stdout=log,
                stderr=log,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # as `rhot up` has it
            )
            stack.enter_context(process)
            stack.callback(process.terminate)
            machine.processes.setdefault(name, []).append(process.pid)

        for n, endpoint in enumerate(machine.endpoints):
            others = json.dumps(machine.endpoints[:n])
            file = folder / f"router{n}.toml"
            file.write_text(
                f'[bus]\nlisten = ["{endpoint}"]\nrouters = {others}\naccess = "open"\n'
                '[[camera]]\nname = "left"\n'
            )
            start("router", "services.cli", "router", "--config", str(file))
            _wait_for(endpoint)
        options = ["--one-process"] if one_process else []
        options += [] if apart else ["--solve"]
        start("services", "services.fusion", "--config", str(configs), *options)
        if apart:
            start("services", "services.solver", "--config", str(configs))
        yield machine


def _wait_for(endpoint: str) -> None:
    port = int(endpoint.rpartition(":")[2])
    deadline_s = time.monotonic() + _START_S
    while time.monotonic() < deadline_s:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise SystemExit("a router did not start")
