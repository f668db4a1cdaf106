"""The tracker's C is compiled where there is a compiler, and nothing fails where there is none."""

from __future__ import annotations

import platform

import pytest

import hatch_build

HERE = platform.machine()


@pytest.fixture
def commands(tmp_path, monkeypatch):
    """A folder that holds all commands there are."""
    folder = tmp_path / "commands"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    for name in ("CC", "RHOT_ZIG"):
        monkeypatch.delenv(name, raising=False)
    return folder


def program(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def test_without_a_compiler_it_says_what_that_means(commands, tmp_path):
    wrong = hatch_build.compile_for(HERE, tmp_path / "tracker.so")
    assert wrong == f"found no compiler for {HERE}"
    told = hatch_build.told(HERE, wrong)
    assert "it measures in Python" in told
    assert "apt install gcc" in told
    assert not (tmp_path / "tracker.so").exists()


def test_a_compiler_that_fails_leaves_what_was_there(commands, tmp_path):
    program(commands / "cc", "echo no space left >&2; echo half >$0.out; exit 1")
    (tmp_path / "tracker.so").write_text("before")
    wrong = hatch_build.compile_for(HERE, tmp_path / "tracker.so")
    assert wrong == "failed: cc: no space left"
    assert (tmp_path / "tracker.so").read_text() == "before"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["commands", "tracker.so"]


def test_the_next_compiler_is_tried(commands, tmp_path):
    program(commands / "cc", "exit 1")
    program(commands / "gcc", 'while [ "$1" != -o ]; do shift; done; echo done >"$2"')
    assert hatch_build.compile_for(HERE, tmp_path / "tracker.so") == ""
    assert (tmp_path / "tracker.so").read_text() == "done\n"


def test_another_machine_is_never_compiled_for_with_this_ones_compiler(commands, tmp_path):
    program(commands / "cc", "exit 0")
    other = "aarch64" if HERE != "aarch64" else "x86_64"
    assert hatch_build.compilers(other) == []
    program(commands / f"{other}-linux-gnu-gcc", "exit 0")
    assert hatch_build.compilers(other) == [[f"{other}-linux-gnu-gcc"]]


def test_the_file_of_this_machine_is_the_one_that_is_looked_for():
    from services.pi_tracker.compiled import library

    assert library.place().name == hatch_build.file_name(HERE)
    assert library.place().parent == hatch_build.ROOT / hatch_build.ROOM
    assert hatch_build.digest().encode() == library._digest()
