"""The start script for Windows, as far as it can be read without PowerShell."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tomllib

from testing.source_tree import ROOT

SCRIPT = (ROOT / "deploy" / "windows" / "rhot-openvr-bridge.ps1").read_text(encoding="ascii")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_it_starts_the_bridge_with_options_that_it_has():
    module, options = re.search(r"& \$executable -m (\S+) (--.*)", SCRIPT).groups()
    assert importlib.util.find_spec(f"{module}.__main__") is not None
    command = [sys.executable, "-m", module, "--help"]
    usage = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert re.findall(r"--\w+", options) == ["--config", "--instance"]
    assert all(option in usage for option in re.findall(r"--\w+", options))


def test_it_installs_an_extra_that_windows_gets():
    (extra,) = re.findall(r"FullName\)\[(\w+)\]", SCRIPT)
    # Windows calls x86_64 AMD64.
    assert "platform_machine == 'AMD64'" in PROJECT["optional-dependencies"][extra][0]
    uvloop = next(one for one in PROJECT["dependencies"] if one.startswith("uvloop"))
    assert "sys_platform != 'win32'" in uvloop


def test_its_brackets_close_and_its_parameters_are_the_guides():
    for opening, closing in ("{}", "()", "[]"):
        assert SCRIPT.count(opening) == SCRIPT.count(closing)
    guide = (ROOT / "docs" / "guide" / "steamvr.md").read_text()
    (used,) = re.findall(r"rhot-openvr-bridge\.ps1 (-.*)", guide)
    for parameter in re.findall(r"-([A-Z]\w+)", used):
        assert re.search(rf"\[string\]\${parameter}\b", SCRIPT)
