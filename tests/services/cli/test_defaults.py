"""The configuration that rhot ships is found, in the source tree and in a wheel."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib

import pytest

from rhot.files.config import load_rig
from services.cli.defaults import config_dir, sim_toml


def test_the_source_trees_own_configuration_is_found(repository):
    assert sim_toml() == repository / "config" / "sim.toml"
    assert load_rig(sim_toml()).camera
    assert (config_dir() / "calibration" / "rig.json").is_file()


def test_the_copy_in_a_wheel_is_found(repository, packages):
    forced = tomllib.loads((repository / "pyproject.toml").read_text())["tool"]["hatch"]["build"][
        "targets"
    ]["wheel"]["force-include"]
    for source, target in forced.items():
        shutil.copytree(repository / source, packages / target)
    found = run(packages, "from services.cli.defaults import sim_toml; print(sim_toml())")
    assert found.stdout.strip() == str(packages / "services" / "cli" / "config" / "sim.toml")


def test_without_either_the_error_says_what_to_do(packages):
    found = run(packages, "from services.cli.defaults import sim_toml; sim_toml()")
    assert "install rhot again, or name a file with --config" in found.stderr


@pytest.fixture
def packages(repository, tmp_path):
    """What the wheel's builder copies as packages, without configuration."""
    for package in ("rhot", "services"):
        ignored = shutil.ignore_patterns("__pycache__", ".*")
        shutil.copytree(repository / package, tmp_path / package, ignore=ignored)
    return tmp_path


def run(folder, script):
    return subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
