"""Which machine becomes what, and by which commands."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Bus, CameraTable
from services.cli.deploy import plan
from services.cli.deploy.plan import HERE, Machine

CAMERAS = [
    CameraTable(name="left", host="pi-left.local"),
    CameraTable(name="right", host="pi-right.local"),
    CameraTable(name="top", host="pi-right.local"),
]
RIG = RigConfig(camera=CAMERAS)
SECURED = RigConfig(camera=CAMERAS, bus=Bus(connect=("tls/192.168.1.10:7448",)))


def test_rig_toml_says_what_each_machine_is():
    assert plan.all_machines(RIG) == [
        Machine(HERE, "master", (), ""),
        Machine("pi-left.local", "pi", ("left",), ""),
        Machine("pi-right.local", "pi", ("right", "top"), ""),
    ]
    # One certificate for a computer with several cameras, named after the first of them.
    assert [one.certificate for one in plan.all_machines(SECURED)] == ["master", "left", "right"]


def test_a_user_of_ssh_and_options_are_taken():
    assert plan.machine(RIG, "pi@pi-left.local").cameras == ("left",)
    assert plan.machine(RIG, "192.168.1.11", "pi", ["top"]).cameras == ("top",)
    assert plan.machine(RIG, "mini", "master") == Machine("mini", "master", (), "")


@pytest.mark.parametrize(
    ("host", "role", "cameras", "says"),
    [
        ("elsewhere", None, [], "pi-left.local"),
        ("elsewhere", "pi", [], "--camera NAME"),
        ("pi-left.local", None, ["middle"], "has no camera 'middle'"),
        ("-oProxyCommand=reboot", "master", [], "is no host"),
        ("a b", "master", [], "is no host"),
        ("", "master", [], "is no host"),
    ],
)
def test_what_rig_toml_does_not_say_is_asked_for(host, role, cameras, says):
    with pytest.raises(ConfigError, match=says):
        plan.machine(RIG, host, role, cameras)


def test_the_copy_is_removed_in_the_end_and_nothing_is_split_by_the_shell():
    of = Machine("pi@pi-left.local", "pi", ("left",), "left")
    install = plan.install_command(of, "rhot-deploy", wheels="--wheels", master="a b")
    commands = plan.remote_commands(of, "/tmp/x", ["-F", "my config"], install)
    assert [command[0] for command in commands] == ["ssh", "scp", "ssh", "ssh"]
    assert "rhot-deploy/pki" in install
    # The far shell gets one word, in which each of ours is quoted.
    _, _, far = commands[2][-1].partition("$S ")
    assert shlex.split(far) == install
    assert commands[-1][-1] == "rm -rf rhot-deploy"


@pytest.mark.parametrize(("role", "told"), [("master", True), ("pi", False)])
def test_only_a_master_is_told_to_replace_its_rig(role, told):
    of = Machine("host", role, (), "")
    command = plan.install_command(of, "x", wheels="--wheels", replace=True)
    assert ("--replace" in command) == told
    assert "--replace" not in plan.install_command(of, "x", wheels="--wheels")


def test_each_machine_gets_its_own_calibrations(tmp_path):
    (tmp_path / "calibration").mkdir()
    for name in ("left.lens.json", "left.colors.json", "right.lens.json", "rig.json"):
        (tmp_path / "calibration" / name).write_text("{}")
    rig = RigConfig(camera=CAMERAS, folder=str(tmp_path))

    def names(of: Machine) -> list[str]:
        return [path.name for path in plan.calibrations(rig, of)]

    assert names(plan.machine(rig, "pi-left.local")) == ["left.colors.json", "left.lens.json"]
    assert len(names(plan.machine(rig, HERE))) == 4


def test_this_machine_needs_no_ssh():
    install = plan.install_command(
        Machine(HERE, "master", (), ""), str(Path("/tmp/x")), wheels="--wheel"
    )
    assert plan.local_command(install, root=False)[:3] == [
        "sudo",
        "/tmp/x/deploy/install.sh",
        "master",
    ]
    assert plan.local_command(install, root=True)[0] == "/tmp/x/deploy/install.sh"
