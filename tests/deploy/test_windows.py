"""The start script for Windows, as far as it can be read without PowerShell."""

from __future__ import annotations

import importlib.util
import re
import struct
import subprocess
import sys
import tomllib

import pytest

from services.bridges.opengloves.glove import HELPER_MARKS, SIZE
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


def opengloves_helper():
    """The script that writes OpenGloves' pipes, as a module."""
    path = ROOT / "deploy" / "windows" / "opengloves-pipe.py"
    spec = importlib.util.spec_from_file_location("opengloves_pipe", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_opengloves_pipes_are_named_and_nothing_else_gets_into_them():
    module = opengloves_helper()
    assert module.PIPES == r"\\.\pipe\vrapplication\input\glove\v2" + "\\"
    assert {mark: hand for hand, mark in HELPER_MARKS.items()} == module.HANDS
    good = struct.pack("<27f", *[0.5] * 27) + bytes(12)
    assert len(good) == SIZE
    assert module.checked(b"L" + good) == ("left", good)
    assert module.checked(b"R" + good) == ("right", good)
    for wrong in (b"", b"L", b"X" + good, b"L" + good[:-1], b"L" + good + b"0"):
        assert module.checked(wrong) is None


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e9, -1.5])
def test_a_value_that_no_glove_has_is_left_out(value):
    data = struct.pack("<27f", value, *[0.0] * 26) + bytes(12)
    assert opengloves_helper().checked(b"L" + data) is None
