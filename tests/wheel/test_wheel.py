"""The built wheel in an empty environment, with each extra alone: what a user gets from pip."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hatch_build import compilers, file_name

MACHINE = platform.machine()
pytestmark = [pytest.mark.wheel, pytest.mark.timeout(900)]

ENTRY_POINTS = (
    "rhot",
    "rhot-pi-tracker",
    "rhot-fusion",
    "rhot-solver",
    "rhot-object-tracker",
    "rhot-openvr-bridge",
    "rhot-simulator",
    "rhot-viewer",
    "rhot-calibrator",
    "rhot-recorder",
    "rhot-metrics",
    "rhot-bridge",
)
# What each extra is for: these entry points must start with it alone.
# rhot-bridge imports what a bridge needs once it knows which.
COMPLETE = {
    "pi": {"rhot-pi-tracker", "rhot-object-tracker", "rhot-openvr-bridge", "rhot-bridge"},
    "master": set(ENTRY_POINTS),
    "openvr": {"rhot-object-tracker", "rhot-openvr-bridge", "rhot-bridge"},
    "study": {"rhot-object-tracker", "rhot-openvr-bridge", "rhot-bridge"},
}


def run(
    *command: str | Path, cwd: Path, timeout_s: float = 600.0
) -> subprocess.CompletedProcess[str]:
    """A command without the source tree in sight."""
    hidden = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    return subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


def installed(python: Path, what: str, cwd: Path) -> None:
    pip = (python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    done = run(*pip, what, cwd=cwd)
    assert done.returncode == 0, done.stderr


def build(repository: Path, folder: Path, **environment: str) -> tuple[Path, str]:
    """rhot's wheel, and what its build says."""
    pip = (sys.executable, "-m", "pip", "wheel", "--verbose", "--disable-pip-version-check")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        done = run(*pip, "--no-deps", "-w", folder, repository, cwd=folder)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("rhot-*.whl")
    return built, done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheel(repository, tmp_path_factory) -> Path:
    return build(repository, tmp_path_factory.mktemp("dist"))[0]


def test_it_has_the_trackers_compiled_form_for_this_machine(wheel):
    if not compilers(MACHINE):
        pytest.skip("no C compiler; apt-get install gcc")
    assert wheel.name.endswith(f"-py3-none-linux_{MACHINE}.whl")
    assert f"services/pi_tracker/compiled/{file_name(MACHINE)}" in zipfile.ZipFile(wheel).namelist()


def test_without_a_compiler_it_installs_everywhere_and_says_so(repository, tmp_path):
    built, said = build(repository, tmp_path, RHOT_COMPILE_FOR="pdp11")
    assert built.name.endswith("-py3-none-any.whl")
    assert not [name for name in zipfile.ZipFile(built).namelist() if name.endswith(".so")]
    assert "rhot: the tracker's C is not compiled: found no compiler for pdp11" in said


def test_a_wheel_for_machines_of_which_one_is_missing_installs_on_both(repository, tmp_path):
    if not compilers(MACHINE):
        pytest.skip("no C compiler; apt-get install gcc")
    built, _ = build(repository, tmp_path, RHOT_COMPILE_FOR=f"pdp11 {MACHINE}")
    assert built.name.endswith("-py3-none-any.whl")
    names = zipfile.ZipFile(built).namelist()
    assert f"services/pi_tracker/compiled/{file_name(MACHINE)}" in names


@pytest.fixture(scope="module", params=COMPLETE)
def environment(request, wheel, tmp_path_factory) -> tuple[str, Path]:
    """(extra, folder of the commands) of a new environment that holds the wheel with one extra."""
    extra = request.param
    folder = tmp_path_factory.mktemp(extra)
    assert run(sys.executable, "-m", "venv", folder / "venv", cwd=folder).returncode == 0
    commands = folder / "venv" / "bin"
    installed(commands / "python", f"{wheel}[{extra}]", folder)
    return extra, commands


def test_it_holds_the_packages_and_the_ready_rig_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {
        "rhot",
        "services",
        "studies",
    }
    for ready in ("sim.toml", "rig.example.toml", "calibration/rig.json"):
        assert f"services/cli/config/{ready}" in names
    assert "rhot/py.typed" in names


def test_every_entry_point_helps_or_names_its_extra(environment, tmp_path):
    extra, commands = environment
    for name in ENTRY_POINTS:
        done = run(commands / name, "--help", cwd=tmp_path)
        said = f"[{extra}] {name} --help: {done.stdout[-500:]}{done.stderr[-500:]}"
        assert "Traceback" not in said, said
        if done.returncode == 0:
            assert done.stdout.lower().startswith("usage:"), said
        else:
            assert name not in COMPLETE[extra], said
            assert done.returncode == 2, said
            assert re.fullmatch(r"[^\n]*pip install 'rhot\[\w+\]'[^\n]*\n", done.stderr), said


def test_services_without_their_extra_say_so_in_one_line(environment, tmp_path):
    """Not only --help: a start, which imports all of a service."""
    extra, commands = environment
    (tmp_path / "rig.toml").write_text("")
    for name in ENTRY_POINTS[1:]:
        if name in COMPLETE[extra]:
            continue
        option = ("--camera", "left") if name == "rhot-pi-tracker" else ()
        done = run(commands / name, "--config", "rig.toml", *option, cwd=tmp_path)
        said = f"[{extra}] {name}: {done.stdout[-500:]}{done.stderr[-500:]}"
        if "pip install 'rhot[" not in said:
            # It has all it needs to get as far as its configuration.
            assert "rig.toml" in said, said
        assert "Traceback" not in said, said
        assert done.returncode == 2, said


def test_the_tracker_measures_compiled_where_that_is_in_the_wheel(environment, wheel):
    extra, commands = environment
    ask = "from services.pi_tracker.compiled.library import state; print(state)"
    said = run(commands / "python", "-c", ask, cwd=commands).stdout
    has_it = any(name.endswith(".so") for name in zipfile.ZipFile(wheel).namelist())
    assert said.startswith("compiled (" if has_it else "in Python: "), f"[{extra}] {said}"


@pytest.mark.parametrize("environment", ["pi"], indirect=True, scope="module")
def test_a_pi_gets_what_a_pi_needs(environment):
    _, commands = environment
    listed = run(commands / "python", "-m", "pip", "list", "--format=freeze", cwd=commands).stdout
    versions = dict(line.split("==") for line in listed.split())
    assert not {"scipy", "numba", "viser", "mcap", "typer", "matplotlib"} & set(versions)
    if sys.version_info < (3, 12):
        # picamera2 of Raspberry Pi OS 12 (Python 3.11) is built for numpy 1.
        assert versions["numpy"].startswith("1."), versions


def digests(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.mark.parametrize("environment", ["master"], indirect=True, scope="module")
def test_the_demo_runs_from_an_empty_folder_and_leaves_the_installation_as_it_is(
    environment, tmp_path
):
    _, commands = environment
    (packages,) = (commands.parent / "lib").glob("python3*/site-packages")
    config = packages / "services" / "cli" / "config"
    before = digests(config)
    assert before
    done = run(commands / "rhot", "demo", "--seconds", "5", cwd=tmp_path)
    said = f"{done.stdout[-2000:]}{done.stderr[-2000:]}"
    assert done.returncode == 0, said
    assert "Traceback" not in said, said
    assert digests(config) == before
    assert not [path.name for path in tmp_path.iterdir()], "the demo left files behind"
