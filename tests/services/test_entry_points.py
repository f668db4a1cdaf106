"""Every installed command with the core dependencies alone: --help and --version work, and what
needs more says in one line which extra to install.

Each command runs as a process of its own in which the modules of the extras cannot be imported.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rhot.process.extras import EXTRAS

REPOSITORY = Path(__file__).parents[2]
SIM = REPOSITORY / "config" / "sim.toml"
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
SERVICES = sorted(name for name in PROJECT["scripts"] if name != "rhot")

# Python imports a module of this name at its start.
SITECUSTOMIZE = """
import os, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in os.environ["MISSING"].split():
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Missing())
"""


@pytest.fixture
def without(tmp_path):
    """`without(modules, program, *arguments)`: the finished process of an installed command."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(SITECUSTOMIZE)

    def run(modules, program, *arguments):
        path = os.pathsep.join([str(tmp_path / "site"), str(REPOSITORY)])
        command = [sys.executable, str(Path(sys.executable).parent / program), *arguments]
        if program == "python":
            command = [sys.executable, *arguments]
        return subprocess.run(
            [str(part) for part in command],
            env={**os.environ, "PYTHONPATH": path, "MISSING": " ".join(modules)},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )

    return run


def refusal(process) -> str:
    """The one line of a command that lacks a module."""
    assert process.returncode == 2, process
    assert process.stdout == ""
    assert "Traceback" not in process.stderr
    (line,) = process.stderr.splitlines()
    return line


@pytest.mark.parametrize("program", SERVICES)
@pytest.mark.parametrize("option", ["--help", "--version"])
def test_services_answer_with_the_core_alone(without, program, option):
    ended = without(EXTRAS, program, option)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith(f"usage: {program}" if option == "--help" else "0.")


@pytest.mark.parametrize(
    ("program", "module", "extra"),
    [
        ("rhot-pi-tracker", "cv2", "pi"),
        ("rhot-fusion", "numba", "master"),
        ("rhot-solver", "numba", "master"),
        ("rhot-simulator", "cv2", "master"),
        ("rhot-viewer", "viser", "master"),
        ("rhot-recorder", "mcap", "master"),
        ("rhot-metrics", "prometheus_client", "master"),
    ],
)
def test_a_service_names_the_extra_it_lacks(without, program, module, extra):
    camera = ("--camera", "left") if program == "rhot-pi-tracker" else ()
    line = refusal(without([module], program, "--config", SIM, *camera))
    assert line.startswith(f"{program}: error: needs {module}, which is not installed")
    assert f"`pip install 'rhot[{extra}]'`" in line


@pytest.mark.parametrize(
    ("module", "extras"),
    [
        ("services.pi_tracker.service", ["pi"]),
        ("services.object_tracker.service", []),
        ("services.openvr_bridge.service", []),
        ("rhot.client", []),
    ],
)
def test_a_pi_and_a_steamvr_machine_need_no_more_than_their_extra(without, module, extras):
    allowed = {"cv2"} if "pi" in extras else set()
    ended = without(set(EXTRAS) - allowed, "python", "-c", f"import {module}")
    assert ended.returncode == 0, ended.stderr


def test_rhot_without_typer_tells_its_version_and_names_the_extra(without):
    ended = without(EXTRAS, "rhot", "--version")
    assert (ended.returncode, ended.stderr) == (0, "")
    for arguments in (("--help",), ("demo",), ()):
        line = refusal(without(["typer"], "rhot", *arguments))
        assert line == (
            "rhot: error: needs typer, which is not installed; run `pip install 'rhot[master]'`"
        )


@pytest.mark.parametrize(
    ("module", "arguments", "extra"),
    [
        ("matplotlib", ("plot", "result"), "study"),
        ("numba", ("simulate", "fist", "--out", "capture"), "master"),
        ("numba", ("warm",), "master"),
        ("cv2", ("track", "capture", "--out", "result"), "master"),
        ("scipy", ("score", "capture", "result"), "master"),
        ("mcap", ("replay", "some.mcap", "--info"), "master"),
    ],
)
def test_a_command_of_rhot_names_the_extra_it_lacks(without, module, arguments, extra):
    line = refusal(without([module], "rhot", *arguments))
    assert line.startswith(f"rhot: error: needs {module}, which is not installed")
    assert f"`pip install 'rhot[{extra}]'`" in line


def test_rhot_helps_without_what_only_single_commands_need(without):
    ended = without({"numba", "scipy", "viser", "cv2", "matplotlib", "openvr"}, "rhot", "--help")
    assert ended.returncode == 0, ended.stderr
    assert "simulate" in ended.stdout


def test_every_module_of_an_extra_is_known():
    """A dependency that is new in pyproject.toml belongs into rhot/process/extras.py too."""
    modules = {
        "opencv-python-headless": "cv2",
        "foxglove-sdk": "foxglove",
        "python-osc": "pythonosc",
    }
    optional = PROJECT["optional-dependencies"]
    for extra in ("pi", *sorted(set(EXTRAS.values()) & set(optional))):
        for requirement in optional[extra]:
            package = re.match(r"[\w-]+", requirement)[0]
            module = modules.get(package, package.replace("-", "_"))
            # An extra may narrow a core dependency: numpy on a Raspberry Pi.
            assert module in {*EXTRAS, "rhot", "numpy"}, f"{extra}: {requirement}"
