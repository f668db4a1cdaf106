"""The shell scripts, read by shellcheck, and what install.sh says without doing anything."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from testing.source_tree import ROOT

INSTALL = ROOT / "deploy" / "install.sh"
SCRIPTS = sorted([*ROOT.glob("deploy/**/*.sh"), *ROOT.glob("tests/**/*.sh")])


def install(*words: str) -> subprocess.CompletedProcess[str]:
    command = [str(INSTALL), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
@pytest.mark.skipif(
    shutil.which("shellcheck") is None,
    reason="shellcheck is missing: sudo apt install shellcheck",
)
def test_shellcheck_has_nothing_to_say(script):
    done = subprocess.run(
        ["shellcheck", script], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["pi"], "which camera?"),
        (["pi", "left"], "where is the master?"),
        (["pi", "le ft", "--master", "m"], "no name of a camera"),
        (["pi", "left", "--master", "a;b"], "is no host"),
        (["master", "--config", "/nowhere/rig.toml"], "no such file"),
        (["master", "--wheels"], "needs a value"),
        (["master", "left"], "unexpected left"),
        (["master", "--frobnicate"], "unknown option --frobnicate"),
        (["rig"], "which rig?"),
        (["rig", "la b", "--config", "rig.toml"], "which rig?"),
        (["rig", "lab", "--config", "/nowhere/rig.toml"], "no such file"),
        (["rig", "lab", "--remove"], "not installed as the master"),
        (["dance"], "unknown command dance"),
    ],
)
def test_a_wrong_command_line_is_told_and_nothing_is_done(words, says):
    done = install(*words, *(["--dry-run"] if len(words) > 1 and words[-1] != "--wheels" else []))
    assert done.returncode == 2
    assert done.stderr.startswith("install.sh: error: ")
    assert says in done.stderr


def test_a_dry_run_says_what_it_would_do():
    done = install("pi", "left", "--master", "192.0.2.10", "--dry-run")
    assert done.returncode == 0, done.stderr
    for what in ("user rhot", "/opt/rhot/versions/new", "rhot-pi-tracker@left.service"):
        assert what in done.stdout
    assert done.stdout.endswith("A dry run: nothing was done.\n")
