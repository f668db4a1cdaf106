"""`rhot deploy` as far as it goes without another machine; tests/deploy/ has one."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from rhot.errors import ConfigError
from rhot.files.config import load_rig
from services.cli.application import application
from services.cli.deploy import plan, staging

RIG = """
[bus]
connect = ["{endpoint}"]
[[camera]]
name = "left"
host = "pi-left.local"
"""


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(RIG.format(endpoint="tcp/192.168.1.10:7447"))
    return path


def deploy(*words):
    return CliRunner().invoke(application(), ["deploy", *map(str, words)])


def test_a_dry_run_prints_each_command_and_runs_none(rig):
    done = deploy("--all", "--config", rig, "--dry-run")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert "here: master" in lines
    assert "pi-left.local: pi left" in lines
    commands = [line.split()[1] for line in lines if line.startswith("  $ ")]
    assert commands[1:] == ["ssh", "scp", "ssh", "ssh"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "which machine?"),
        (["pi-left.local", "--all"], "which machine?"),
        (["--all", "--role", "pi"], "go with one HOST"),
        (["pi-left.local", "--role", "boss"], "valid: pi, master"),
        (["pi-left.local", "--wheels", "/nowhere"], "holds no wheel of rhot"),
    ],
)
def test_a_wrong_command_line_is_told(rig, words, says):
    done = deploy(*words, "--config", rig)
    assert isinstance(done.exception, ConfigError)
    assert says in str(done.exception)


def test_a_secured_bus_needs_the_machines_certificate(rig):
    rig.write_text(RIG.format(endpoint="tls/192.168.1.10:7448"))
    config = load_rig(rig)
    of = plan.machine(config, "pi-left.local")
    with pytest.raises(ConfigError, match="rhot pki init"):
        staging.certificate_files(of, config)


def test_what_is_brought_lies_together(rig, tmp_path):
    config = load_rig(rig)
    wheel = tmp_path / "rhot-1.0-py3-none-any.whl"
    wheel.write_text("")
    folder = tmp_path / "staged"
    folder.mkdir()
    staging.stage(plan.machine(config, "pi-left.local"), config, rig, [wheel], folder)
    for name in ("deploy/install.sh", "deploy/systemd/rhot-pi.target", f"wheels/{wheel.name}"):
        assert (folder / name).is_file()
    assert (folder / "rig.toml").read_text() == rig.read_text()


def test_wheels_of_the_role_are_taken(tmp_path, rig):
    for role in ("pi", "master"):
        (tmp_path / role).mkdir()
        (tmp_path / role / f"rhot-{role}-py3-none-any.whl").write_text("")
    of = plan.machine(load_rig(rig), "pi-left.local")
    assert [path.name for path in staging.wheels_for(of, tmp_path)] == ["rhot-pi-py3-none-any.whl"]
