"""Collect every wheel that install.sh needs without a network: `make wheels`.

dist/wheels/master holds rhot and its dependencies for this machine, dist/wheels/pi those for 64-bit
Raspberry Pi OS 12 and 13 (Python 3.11 and 3.13). rhot's own wheel has the tracker's compiled form
for that machine. Where there is no compiler for a Pi (apt install gcc-aarch64-linux-gnu), PyPI's
ziglang is fetched once into build/zig, 80 MB; without either the tracker measures in Python there.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from pip._vendor.packaging.requirements import Requirement

from hatch_build import compilers, file_name

SOURCE = Path(__file__).resolve().parents[1]
# Debian 12 and 13 have glibc 2.36 and 2.41: wheels of both older tags run there.
PI_PLATFORMS = ("manylinux_2_28_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64")
ZIG = SOURCE / "build" / "zig"
SYSTEM_PYTHON = "/usr/bin/python3"
PI_MACHINE, PI_PYTHONS = "aarch64", ("3.11", "3.13")


def requirements(extra: str, python: str, machine: str) -> list[str]:
    """What rhot with one extra needs under that Python on that machine.

    `pip download` asks markers of the Python it runs in, whatever --python-version says: so they
    are asked here.
    """
    project = tomllib.loads((SOURCE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    environment = {"python_version": python, "platform_machine": machine, "extra": extra}
    wanted = []
    for line in [*project["dependencies"], *project["optional-dependencies"][extra]]:
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate(environment):
            wanted.append(f"{requirement.name}{requirement.specifier}")
    return wanted


def pip(*arguments: str, **environment: str) -> None:
    """Run pip of this Python; its failure ends the program with its code."""
    code = _pip_code(*arguments, **environment)
    if code:
        sys.exit(code)


def _pip_code(*arguments: str, **environment: str) -> int:
    quiet = ("--quiet", "--disable-pip-version-check")
    command = [sys.executable, "-m", "pip", *arguments[:1], *quiet, *arguments[1:]]
    return subprocess.run(command, check=False, env=os.environ | environment).returncode


def own_wheel(folder: Path, machine: str) -> str:
    """Build rhot's wheel for a machine; returns how its tracker measures there."""
    if not compilers(machine) and not ZIG.is_dir():
        print(f"no compiler for {machine}: fetching ziglang from PyPI into {ZIG}")
        _pip_code("install", "--no-deps", "--target", str(ZIG), "ziglang")
    # An older build of the same number would be taken for the newest.
    for old in folder.glob("rhot-*.whl"):
        old.unlink()
    environment = {"RHOT_COMPILE_FOR": machine, "RHOT_ZIG": str(ZIG)}
    pip("wheel", "--no-deps", "--wheel-dir", str(folder), str(SOURCE), **environment)
    (made,) = folder.glob("rhot-*.whl")
    with zipfile.ZipFile(made) as wheel:
        compiled = any(name.endswith(file_name(machine)) for name in wheel.namelist())
    return f"compiled for {machine}" if compiled else f"in Python: not compiled for {machine}"


def collect_pi(folder: Path) -> None:
    """Wheels of a Pi's tracker, for each Python that Raspberry Pi OS has."""
    platforms = [option for one in PI_PLATFORMS for option in ("--platform", one)]
    for python in PI_PYTHONS:
        _download(folder, "pi", python, PI_MACHINE, platforms)


def collect_master(folder: Path) -> None:
    """Wheels of a master like this machine, for the Python that install.sh takes."""
    ask = "import sys; print('%d.%d' % sys.version_info[:2])"
    python = SYSTEM_PYTHON if Path(SYSTEM_PYTHON).exists() else sys.executable
    done = subprocess.run([python, "-c", ask], capture_output=True, text=True, check=True)
    _download(folder, "master", done.stdout.strip(), platform.machine(), [])


def _download(folder: Path, extra: str, python: str, machine: str, options: list[str]) -> None:
    target = ["--only-binary=:all:", "--python-version", python, *options]
    pip("download", *target, "--dest", str(folder), *requirements(extra, python, machine))


COLLECT = {"master": collect_master, "pi": collect_pi}


def main() -> None:
    """Fill dist/wheels, or the folder that --out names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=SOURCE / "dist" / "wheels")
    parser.add_argument("roles", nargs="*", choices=[[], *COLLECT], metavar="master|pi")
    options = parser.parse_args()
    for role in options.roles or COLLECT:
        folder = options.out / role
        folder.mkdir(parents=True, exist_ok=True)
        measures = own_wheel(folder, PI_MACHINE if role == "pi" else platform.machine())
        COLLECT[role](folder)
        count = len(list(folder.glob("*.whl")))
        print(f"{folder}: {count} wheels; rhot's tracker measures {measures}")


if __name__ == "__main__":
    main()
