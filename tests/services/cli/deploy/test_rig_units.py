"""The units that install.sh enables for a rig.toml."""

from __future__ import annotations

import subprocess
import sys

import pytest

from rhot.files.config import load_rig
from services.cli.defaults import config_dir
from services.cli.deploy.rig_units import master_units, user_units
from services.cli.live.up import children_of


def asked(question, *paths) -> subprocess.CompletedProcess[str]:
    """What install.sh runs."""
    command = [sys.executable, "-m", "services.cli.deploy.rig_units", question, *map(str, paths)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


# One camera, and all that a rig.toml must switch on.
SWITCHED_ON = """
[[camera]]
name = "left"
host = "pi-left"
[metrics]
enabled = true
[bridges.vmc]
enabled = true
"""


@pytest.mark.parametrize("name", ["sim.toml", "rig.example.toml", ""])
def test_a_master_runs_what_rhot_up_runs(name, tmp_path):
    path = config_dir() / name if name else tmp_path / "rig.toml"
    if not name:
        path.write_text(SWITCHED_ON)
    rig = load_rig(path)
    children = children_of(rig, path, viewer=True)
    names = (child.name.replace("_", "-").replace("/", "@") for child in children)
    units = {*master_units(rig), *user_units(rig)}
    assert units - {"rhot-pi.target"} == {f"rhot-{name}.service" for name in names}


def test_the_name_of_a_rig_is_told(tmp_path):
    (tmp_path / "rig.toml").write_text('[rig]\nname = "lab"\n')
    assert asked("name", tmp_path / "rig.toml").stdout == "lab\n"


def test_a_further_rig_asks_for_what_serves_it(tmp_path):
    first, rigs = tmp_path / "rig.toml", tmp_path / "rigs"
    first.write_text(SWITCHED_ON)
    serves = {"rhot-object-tracker.service"}
    alone = set(asked("units", first, rigs).stdout.split())
    assert not alone & serves
    for name, text in (
        ("lab", (config_dir() / "sim.toml").read_text()),
        ("shop", '[[object]]\nname = "cup"\nserial = "LHR-1"\n'),
        ("wrong", "no toml"),
    ):
        (rigs / name).mkdir(parents=True)
        (rigs / name / "rig.toml").write_text(text)
    assert set(asked("units", first, rigs).stdout.split()) == alone | serves


@pytest.mark.parametrize(
    ("objects", "units"),
    [
        ('source = "steamvr"', ["rhot-openvr-bridge.service"]),
        ('source = "steamvr"\nhost = "gaming-pc"', []),
        ('source = "libsurvive"', []),
    ],
)
def test_steamvr_on_the_master_is_its_users(objects, units, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(f'[objects]\n{objects}\n[[object]]\nname = "cup"\nserial = "LHR-1"\n')
    assert asked("user-units", path).stdout.split() == units
    assert "rhot-openvr-bridge.service" not in asked("units", path).stdout
    names = [child.name for child in children_of(load_rig(path), path, viewer=True)]
    assert ("openvr_bridge" in names) == bool(units)


def test_bridges_that_are_enabled_run(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("[bridges.vmc]\nenabled = true\n[bridges.monado]\nenabled = true\n")
    bridges = [one for one in asked("units", path).stdout.split() if "bridge" in one]
    assert bridges == ["rhot-bridge@vmc.service", "rhot-bridge@monado.service"]
    children = children_of(load_rig(path), path, viewer=True)
    (vmc, _) = [child for child in children if child.name.startswith("bridge/")]
    assert vmc.argv[-2:] == ["--instance", "vmc"]


def test_install_sh_gets_lines(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[bus]\nconnect = ["tcp/a:1", "tls/b:2"]\n[recorder]\nautostart = true\n')
    assert asked("connect", path).stdout.split() == ["tcp/a:1", "tls/b:2"]
    assert asked("secured", path).stdout.split() == ["tls/b:2"]
    assert asked("units", path).stdout.split() == [
        "rhot-router.service",
        "rhot-fusion.service",
        "rhot-viewer.service",
        "rhot-calibrator.service",
        "rhot-recorder.service",
    ]
    assert asked("check", path).stdout == ""
    path.write_text("[bsu]\n")
    wrong = asked("check", path)
    assert wrong.returncode == 2
    assert "bsu" in wrong.stderr
    assert len(wrong.stderr.splitlines()) == 1
