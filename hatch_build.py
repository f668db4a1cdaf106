"""Compiles the tracker's C at installation: `pip install`, `pip install -e .`, and wheels.

    python hatch_build.py [MACHINE]    compiles into the source tree, and says what it did

Without a compiler there is no compiled form; the build says so, and the tracker measures in Python.
RHOT_COMPILE_FOR names the machines (as `uname -m` has them, e.g. "aarch64") that a wheel is for,
if not the one that builds it. A wheel with the compiled form of each of them carries their tags;
one without any of these carries `any`, as it runs there, too. RHOT_ZIG is a folder with PyPI's
ziglang, a compiler for every machine.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # called by hand
    BuildHookInterface = object

ROOT = Path(__file__).resolve().parent
ROOM = Path("services/pi_tracker/compiled")
# Results must not depend on the machine: no fused operations, nothing of -ffast-math. (That square
# roots set no errno and traps are ignored changes no result.) What is compiled uses no library, so
# that it runs with any: no calls of memset for a loop, no stack protector.
FLAGS = (
    *("-std=c11", "-O3", "-shared", "-fPIC", "-nostdlib", "-s"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
    *("-fno-stack-protector", "-fno-builtin", "-fno-sanitize=all"),
)
TIMEOUT_S = 300.0


def sources(root: Path = ROOT) -> list[Path]:
    """All C of the tracker, headers first by name."""
    return sorted(path for path in (root / ROOM).iterdir() if path.suffix in {".c", ".h"})


def digest(root: Path = ROOT) -> str:
    """Tells one state of the sources from another; alike in library.py, which compares."""
    of = hashlib.sha256()
    for path in sources(root):
        of.update(path.read_bytes())
    return of.hexdigest()[:16]


def file_name(machine: str) -> str:
    """The compiled form's, for Linux on a machine."""
    return f"tracker-linux-{machine}.so"


def compilers(machine: str) -> list[list[str]]:
    """Commands that compile for a machine, as far as they are here."""
    found = []
    if machine == platform.machine():
        names = [os.environ.get("CC", "").split(), ["cc"], ["gcc"], ["clang"]]
    else:
        names = [[f"{machine}-linux-gnu-gcc"], ["clang", f"--target={machine}-linux-gnu"]]
    found += [words for words in names if words and shutil.which(words[0])]
    zig = os.environ.get("RHOT_ZIG")
    if zig:
        program = str(Path(zig) / "ziglang" / "zig")
        found.append([program, "cc", "-target", f"{machine}-linux-gnu"])
    return found


def compile_for(machine: str, into: Path, root: Path = ROOT, flags: tuple[str, ...] = ()) -> str:
    """Compile into a file; returns what went wrong, nothing if nothing did."""
    if not sys.platform.startswith("linux"):
        return "is for Linux only"
    wrong = f"found no compiler for {machine}"
    units = [str(path) for path in sources(root) if path.suffix == ".c"]
    for words in compilers(machine):
        # Not written over: a tracker that runs may have the file open.
        new = into.with_suffix(".new")
        named = f'-DRHOT_DIGEST="{digest(root)}"'
        command = [*words, *FLAGS, *flags, named, *units, "-o", str(new)]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            wrong = f"failed: {error}"
            continue
        if done.returncode == 0:
            new.replace(into)
            return ""
        new.unlink(missing_ok=True)
        lines = done.stderr.strip().splitlines() or ["(it says nothing)"]
        wrong = f"failed: {' '.join(words)}: {lines[0]}"
    return wrong


class CustomBuildHook(BuildHookInterface):
    """Hatchling's way to call this."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile for each machine, and say for which it succeeded."""
        root, editable = Path(self.root), version == "editable"
        wanted = os.environ.get("RHOT_COMPILE_FOR", "").replace(",", " ").split()
        machines = [platform.machine()] if editable or not wanted else wanted
        self._folder = Path(tempfile.mkdtemp(prefix="rhot-compiled-"))
        made = []
        for machine in machines:
            name = file_name(machine)
            into = (root / ROOM if editable else self._folder) / name
            wrong = compile_for(machine, into, root)
            self.app.display_info(told(machine, wrong))
            if not wrong:
                made.append(machine)
                if not editable:
                    build_data["force_include"][str(into)] = str(ROOM / name)
        if made == machines and not editable:
            build_data["pure_python"] = False
            platforms = ".".join(f"linux_{machine}" for machine in sorted(made))
            build_data["tag"] = f"py3-none-{platforms}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what is in the wheel now."""
        del version, build_data, artifact_path
        shutil.rmtree(self._folder, ignore_errors=True)


def told(machine: str, wrong: str) -> str:
    """What a person reads."""
    if not wrong:
        return f"rhot: the tracker's C is compiled for {machine}"
    return (
        f"rhot: the tracker's C is not compiled: {wrong}; on {machine} it measures in Python, "
        "the same in three times the time (for the compiled form: apt install gcc, install again)"
    )


def main() -> None:
    """Compile into the source tree."""
    machine = sys.argv[1] if len(sys.argv) > 1 else platform.machine()
    wrong = compile_for(machine, ROOT / ROOM / file_name(machine))
    print(told(machine, wrong))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
