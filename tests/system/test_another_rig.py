"""One more rig on a master that runs: served beside the first, and taken away again."""

from __future__ import annotations

import time

import pytest

from testing.hosts.container import copy_in
from testing.hosts.hosted_rig import LOOPBACK, MASTER
from testing.hosts.planted import HANG_S
from testing.hosts.poses import PoseWatch
from testing.hosts.rig_files import NAME, write_rig

# The first test waits for the installation, and kernels take minutes where none are kept.
pytestmark = [pytest.mark.system, pytest.mark.timeout(1800)]

INSTALL, RHOT = "/opt/rhot/current/deploy/install.sh", "/opt/rhot/current/bin/rhot"
LAB = "/srv/brought/lab/rig.toml"
OWN = ("rhot-recorder@lab.service", "rhot-calibrator@lab.service")
# The first rig keeps the first port.
PAGE = "import urllib.request as r; print(r.urlopen('http://127.0.0.1:8081/').status)"


@pytest.fixture
def lab(rig):
    """Sees what the second rig's services say of themselves."""
    seen = PoseWatch(rig.network.namespace_path(MASTER), "lab", LOOPBACK)
    yield seen
    seen.close()


def more_poses(watch, seconds: float) -> bool:
    """Whether the first rig's poses go on."""
    begun, deadline_s = len(watch.poses), time.monotonic() + seconds
    while time.monotonic() < deadline_s:
        if sum(pose.live for pose in watch.poses[begun:]) >= 10:
            return True
        time.sleep(0.2)
    return False


def test_one_more_rig_is_served_beside_the_first(rig, watch, lab, tmp_path):
    master, folder = rig.master, tmp_path / "lab"
    folder.mkdir()
    path = write_rig(folder)
    text = path.read_text()
    path.write_text(text.replace(f'"{NAME}"', '"lab"').replace(":7448", ":7449"))
    copy_in(master, folder, "/srv/brought")
    master.run(RHOT, "pki", "init", "--config", LAB)
    pki = f"{LAB.removesuffix('rig.toml')}pki-hosts/master"
    said = master.run(INSTALL, "rig", "lab", "--config", LAB, "--pki", pki, timeout_s=120.0)
    assert "/etc/rhot/rigs/lab/rig.toml" in said
    assert "left out" not in said
    assert lab.wait_value("solver", "right_from_tables", 1.0, HANG_S), rig.journals()
    assert lab.wait_value("fusion", "observations_hz", 0.0, HANG_S), rig.journals()
    assert lab.wait_value("recorder", "recording", 1.0, HANG_S), rig.journals()
    assert list((master.disk / "var/lib/rhot/rigs/lab/recordings").glob("*.mcap"))
    assert master.run("systemctl", "is-active", *OWN).split() == ["active"] * 2
    assert more_poses(watch, HANG_S), rig.journals()
    assert "7449" in master.run("ss", "-ltn")
    assert lab.wait_value("viewer", "port", 8081.0, HANG_S), rig.journals()
    assert master.run("/opt/rhot/current/bin/python", "-c", PAGE).strip() == "200"
    assert "further rigs: lab" in master.run(INSTALL, "status")
    assert "Nothing to do" in master.run(INSTALL, "rig", "lab", "--config", LAB, timeout_s=120.0)


def test_its_file_does_not_take_the_place_of_the_first_ones(rig, watch):
    before = rig.master.run("cat", "/etc/rhot/rig.toml")
    wrong = ("/srv/deploy/install.sh", "master", "--wheels", "/srv/wheels", "--config", LAB)
    said = rig.master.try_run(*wrong, timeout_s=300.0)
    assert f"this master serves the rig {NAME}" in said
    assert "install.sh rig lab --config FILE" in said
    assert rig.master.run("cat", "/etc/rhot/rig.toml") == before
    assert more_poses(watch, HANG_S), rig.journals()


def test_it_is_taken_away_again(rig, watch, lab):
    said = rig.master.run(INSTALL, "rig", "lab", "--remove", timeout_s=120.0)
    assert "calibrations and recordings stay in /var/lib/rhot/rigs/lab" in said
    assert rig.master.try_run("systemctl", "is-active", *OWN).split() == ["inactive"] * 2
    assert "further rigs: none" in rig.master.run(INSTALL, "status")
    assert more_poses(watch, HANG_S), rig.journals()
    assert "7449" not in rig.master.run("ss", "-ltn")
    assert not lab.wait_value("solver", "right_from_tables", 1.0, 3.0)
