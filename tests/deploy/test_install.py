"""install.sh and `rhot deploy` on a Pi's stand-in: a container with a real systemd, and sshd.

The tests follow each other, as a machine's life does. A master is installed by `make test-system`.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
from pathlib import Path

import pytest

from testing import hosts
from testing.hosts.commands import run
from testing.hosts.container import Container
from testing.hosts.network import Network

SYSTEM_PYTHON = Path("/usr/bin/python3")
INSTALL, RUNS = "/srv/deploy/install.sh", "/opt/rhot/current/deploy/install.sh"
UNIT = "rhot-pi-tracker@left.service"


def why_not() -> str:
    """Why these tests cannot run here; empty if they can."""
    if reason := hosts.missing():
        return reason
    if not shutil.which("sshd"):
        return "needs Debian packages: sudo apt install openssh-server"
    version = run([SYSTEM_PYTHON, "-c", "import sys; print(*sys.version_info[:2])"]).split()
    if version != [str(number) for number in sys.version_info[:2]]:
        return f"{SYSTEM_PYTHON} is Python {'.'.join(version)}, and its wheels are not ours"
    return ""


pytestmark = [
    pytest.mark.wheel,
    pytest.mark.timeout(900),
    pytest.mark.skipif(bool(why_not()), reason=why_not()),
]


def wait_until_active(host: Container, unit: str, pid: str = "") -> str:
    """Its process, which is another than `pid`."""
    deadline_s = time.monotonic() + 60.0
    while time.monotonic() < deadline_s:
        found = host.show(unit, "ActiveState", "MainPID")
        if found["ActiveState"] == "active" and found["MainPID"] != pid:
            return found["MainPID"]
        time.sleep(0.2)
    pytest.fail(f"{unit} is not active:\n{host.journal('-u', unit)}")


def wait_for_status(host: Container, text: str) -> None:
    """The tracker says for what it waits."""
    deadline_s = time.monotonic() + 60.0
    while text not in host.show(UNIT, "StatusText").get("StatusText", ""):
        assert time.monotonic() < deadline_s, host.journal("-u", UNIT)
        time.sleep(0.2)


def current(host: Container) -> str:
    return host.run("readlink", "/opt/rhot/current").strip().rpartition("/")[2]


def test_a_pi_is_installed_without_a_network(pi):
    said = pi.run(
        *(INSTALL, "pi", "left", "--master", "127.0.0.1"),
        *("--config", "/srv/rig.toml", "--wheels", "/srv/now"),
        timeout_s=600.0,
    )
    assert "is installed as pi" in said
    assert "What comes next" in said
    assert pi.run("/opt/rhot/current/bin/rhot-pi-tracker", "--version").strip()
    assert pi.run("stat", "-c", "%U %a", "/var/lib/rhot/calibration").strip() == "rhot 2775"
    assert pi.run("systemctl", "is-enabled", "rhot-pi.target", UNIT).split() == ["enabled"] * 2
    # 250, in the kernel's own steps.
    asked_ms = int(pi.run("cat", "/proc/sys/net/ipv4/neigh/eth0/retrans_time_ms"))
    assert 240 <= asked_ms <= 260


def test_the_tracker_waits_for_its_router_and_for_its_colours(pi):
    assert pi.show(UNIT, "ActiveState")["ActiveState"] == "activating"
    router = ("systemd-run", "-q", "--unit=router", "/opt/rhot/current/bin/python")
    pi.run(*router, "/srv/router.py")
    wait_for_status(pi, "rhot calibrate colors left")
    assert pi.show(UNIT, "ActiveState", "NRestarts") == {
        "ActiveState": "activating",
        "NRestarts": "0",
    }
    pi.run("cp", "/srv/left.colors.json", "/etc/rhot/calibration/")
    wait_until_active(pi, UNIT)


def test_the_tracker_runs_in_its_sandbox(pi):
    pid = wait_until_active(pi, UNIT)
    status = pi.run("cat", f"/proc/{pid}/status")
    assert re.search(r"^Seccomp:\t2$", status, re.MULTILINE), status
    assert re.search(r"^CapBnd:\t0+$", status, re.MULTILINE), status
    video = pi.run("getent", "group", "video").split(":")[2]
    assert re.search(rf"^Groups:.*\b{video}\b", status, re.MULTILINE), status
    assert pi.run("ps", "-o", "user=", "-p", pid).strip() == "rhot"
    assert pi.show(UNIT, "WatchdogUSec")["WatchdogUSec"] == "10s"


def test_a_second_run_changes_nothing(pi):
    pid = pi.show(UNIT, "MainPID")["MainPID"]
    said = pi.run(INSTALL, "upgrade", "--wheels", "/srv/now", timeout_s=600.0)
    assert "\nNothing to do: " in f"\n{said}", said
    assert pi.show(UNIT, "MainPID")["MainPID"] == pid


def test_a_killed_tracker_is_back_at_once(pi):
    pid = pi.show(UNIT, "MainPID")["MainPID"]
    pi.run("kill", "-9", pid)
    wait_until_active(pi, UNIT, pid)


def test_a_broken_rig_toml_is_waited_for_and_not_spun_on(pi):
    good = pi.run("cat", "/etc/rhot/rig.toml")
    pi.run("sh", "-c", "echo nonsense >>/etc/rhot/rig.toml")
    pi.run("systemctl", "restart", "--no-block", UNIT)
    wait_for_status(pi, "not valid TOML")
    before = pi.show(UNIT, "NRestarts")["NRestarts"]
    time.sleep(5.0)
    assert pi.show(UNIT, "NRestarts")["NRestarts"] == before
    pi.run("sh", "-c", f"printf %s '{good}' >/etc/rhot/rig.toml")
    wait_until_active(pi, UNIT)


def test_an_upgrade_that_fails_leaves_what_runs(pi):
    pi.run("sh", "-c", "mkdir /srv/broken; cp /srv/next/rhot-*.whl /srv/broken/")
    before, pid = current(pi), pi.show(UNIT, "MainPID")["MainPID"]
    said = pi.try_run(INSTALL, "upgrade", "--wheels", "/srv/broken", timeout_s=600.0)
    assert "nothing was changed for the version that runs" in said
    assert (current(pi), pi.show(UNIT, "MainPID")["MainPID"]) == (before, pid)


def test_an_upgrade_and_a_rollback_switch_what_runs(pi):
    old, pid = current(pi), pi.show(UNIT, "MainPID")["MainPID"]
    pi.run(INSTALL, "upgrade", "--wheels", "/srv/next", timeout_s=600.0)
    assert current(pi).startswith("9.9.9-")
    pid = wait_until_active(pi, UNIT, pid)
    assert "9.9.9" in pi.run("/opt/rhot/current/bin/rhot-pi-tracker", "--version")
    assert pi.run(RUNS, "rollback").startswith(f"Back to rhot {old}")
    assert current(pi) == old
    wait_until_active(pi, UNIT, pid)
    assert "there is no earlier version" in pi.try_run(RUNS, "rollback")
    assert f"version {old} (current)" in pi.run(RUNS, "status")


def test_a_unit_that_the_new_version_does_without_goes(pi):
    """What it did may be another one's work now, and is not to be done twice."""
    text = "[Service]\nExecStart=/bin/sleep infinity\n[Install]\nWantedBy=rhot-pi.target\n"
    pi.run("sh", "-c", f"printf '{text}' >/etc/systemd/system/rhot-former.service")
    pi.run("systemctl", "daemon-reload")
    pi.run("systemctl", "enable", "rhot-former.service")
    # Not waited for: units of rhot say when they are ready, and this one never does.
    pi.run("systemctl", "start", "--no-block", "rhot-former.service")
    said = pi.run(INSTALL, "upgrade", "--wheels", "/srv/now", timeout_s=600.0)
    assert "take away rhot-former.service" in said
    found = pi.show("rhot-former.service", "ActiveState", "LoadState", "UnitFileState")
    assert (found["ActiveState"], found["LoadState"]) == ("inactive", "not-found")
    assert "rhot-former" not in pi.run("ls", "/etc/systemd/system/rhot-pi.target.wants")
    wait_until_active(pi, UNIT)


def test_three_versions_are_kept(pi):
    for name in ("0.0.1-a", "0.0.2-b", "0.0.3-c"):
        pi.run(
            "sh",
            "-c",
            f"mkdir /opt/rhot/versions/{name}; touch /opt/rhot/versions/{name}/.complete",
        )
        pi.run("sed", "-i", f"1i {name}", "/opt/rhot/history")
    pi.run(INSTALL, "upgrade", "--wheels", "/srv/next", timeout_s=600.0)
    kept = pi.run("ls", "/opt/rhot/versions").split()
    assert len(kept) == 3
    assert current(pi) in kept


def at_the_desk(
    network: Network, host: str, folder: Path, wheels: Path, *options: str | Path
) -> list[str | Path]:
    """`rhot deploy` of the rig in `folder`, on another computer of the network."""
    inside = ["ip", "netns", "exec", network.namespace("desk"), sys.executable]
    command = ["-m", "services.cli", "deploy", host, "--config", folder / "rig.toml"]
    return [*inside, *command, "--wheels", wheels, *options]


def test_rhot_deploy_brings_rhot_and_the_rigs_file_over_ssh(
    pi, network, wheels, ssh_config, rig_toml, tmp_path
):
    (tmp_path / "rig.toml").write_text(rig_toml + "fps = 25.0\n")
    (tmp_path / "calibration").mkdir()
    (tmp_path / "calibration" / "left.lens.json").write_text("{}")
    (tmp_path / "calibration" / "right.lens.json").write_text("{}")
    before = current(pi)
    said = run(
        at_the_desk(network, "pi-left", tmp_path, wheels[0], "--ssh-config", ssh_config),
        timeout_s=600.0,
        environment=os.environ,
    )
    assert "pi-left: pi left" in said
    assert "keep the old rig.toml as /etc/rhot/rig.toml.bak" in said
    assert pi.run("cat", "/etc/rhot/rig.toml") == (tmp_path / "rig.toml").read_text()
    assert pi.run("ls", "/var/lib/rhot/calibration").split() == [
        "left.colors.json",
        "left.lens.json",
    ]
    assert current(pi) != before
    assert "rhot-deploy" not in pi.run("ls", "-a", "/root")


def test_a_host_that_is_not_there_is_told(network, ssh_config, wheels, rig_toml, tmp_path):
    (tmp_path / "rig.toml").write_text(rig_toml.replace('"pi-left"', '"10.77.0.99"'))
    said = run(
        at_the_desk(network, "10.77.0.99", tmp_path, wheels[0]),
        timeout_s=120.0,
        environment=os.environ,
        check=False,
    )
    assert "rhot deploy: failed on 10.77.0.99" in said


def test_uninstall_leaves_the_data_and_purge_nothing(pi):
    pi.run("systemctl", "stop", "router")
    assert "/var/lib/rhot" in pi.run(RUNS, "uninstall")
    assert pi.processes("rhot") == []
    pi.run("test", "!", "-e", "/opt/rhot")
    pi.run("test", "!", "-e", "/etc/sysctl.d/60-rhot.conf")
    pi.run("test", "-f", "/etc/rhot/rig.toml")
    assert "rhot-" not in pi.run("systemctl", "list-unit-files", "--no-legend")
    assert "rhot is removed" in pi.run(INSTALL, "uninstall", "--purge")
    assert (
        pi.try_run("ls", "-d", "/etc/rhot", "/var/lib/rhot", "/var/cache/rhot").count("No such")
        == 3
    )
    assert "no such user" in pi.try_run("id", "rhot")
    assert "Nothing to do" in pi.run(INSTALL, "uninstall", "--purge")
