"""The configuration that rhot brings along is found, from the source tree and from a wheel."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib

from rhot.files.config import load_rig
from services.cli.defaults import config_dir, sim_toml


def test_the_source_trees_own_configuration_is_found(repository):
    assert sim_toml() == repository / "config" / "sim.toml"
    assert load_rig(sim_toml()).camera
    assert (config_dir() / "calibration" / "rig.json").is_file()


def test_the_copy_in_a_wheel_is_found(repository, tmp_path):
    forced = tomllib.loads((repository / "pyproject.toml").read_text())["tool"]["hatch"]["build"][
        "targets"
    ]["wheel"]["force-include"]
    # What the wheel's builder does: packages, and the copy where pyproject.toml puts it.
    for package in ("rhot", "services"):
        shutil.copytree(
            repository / package,
            tmp_path / package,
            ignore=shutil.ignore_patterns("__pycache__", ".*"),
        )
    for source, target in forced.items():
        shutil.copytree(repository / source, tmp_path / target)
    script = "from services.cli.defaults import sim_toml; print(sim_toml())"
    found = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert found.stdout.strip() == str(tmp_path / "services" / "cli" / "config" / "sim.toml")


def test_without_either_the_error_says_what_to_do(repository, tmp_path):
    for package in ("rhot", "services"):
        shutil.copytree(
            repository / package,
            tmp_path / package,
            ignore=shutil.ignore_patterns("__pycache__", ".*"),
        )
    script = "from services.cli.defaults import sim_toml; sim_toml()"
    found = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert "install rhot again, or name a file with --config" in found.stderr
