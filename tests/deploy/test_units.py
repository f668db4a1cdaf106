"""The systemd units, as systemd itself reads them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from testing.source_tree import ROOT

UNITS, USER_UNITS = ROOT / "deploy" / "systemd", ROOT / "deploy" / "systemd-user"
SERVICES = sorted(path.name for path in UNITS.glob("*.service"))
TARGETS = sorted(path.name for path in UNITS.glob("*.target"))
# `systemd-analyze security` on its scale of 0 to 10, times 10.
MAX_EXPOSURE = 20

pytestmark = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None,
    reason="systemd-analyze is missing: sudo apt install systemd",
)


def analyze(*words: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    command = ["systemd-analyze", *map(str, words)]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.fixture
def units(tmp_path) -> Path:
    """The units, with commands that exist on this machine, too."""
    folder = tmp_path / "systemd"
    shutil.copytree(UNITS, folder)
    for path in folder.glob("*.service"):
        text = path.read_text()
        assert re.search(r"^ExecStart=/opt/rhot/current/bin/rhot", text, re.MULTILINE), path.name
        path.write_text(re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", text, flags=re.MULTILINE))
    return folder


def test_every_service_of_the_rig_has_a_unit():
    assert {
        "rhot-router.service",
        "rhot-pi-tracker@.service",
        "rhot-fusion.service",
        "rhot-object-tracker.service",
        "rhot-viewer.service",
        "rhot-calibrator.service",
        "rhot-recorder.service",
        "rhot-simulator.service",
        "rhot-bridge@.service",
    } <= set(SERVICES)
    assert TARGETS == ["rhot-master.target", "rhot-pi.target"]


@pytest.mark.parametrize("name", [*SERVICES, *TARGETS])
def test_systemd_has_nothing_to_say_about_a_unit(units, name):
    done = analyze("verify", units / name)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_an_unknown_setting_would_be_told(units):
    path = units / "rhot-fusion.service"
    path.write_text(path.read_text().replace("[Service]\n", "[Service]\nProtectSytem=strict\n"))
    assert "ProtectSytem" in analyze("verify", path).stderr


@pytest.mark.parametrize("name", SERVICES)
def test_a_service_reaches_nothing_that_it_does_not_need(name):
    threshold = f"--threshold={MAX_EXPOSURE}"
    done = analyze("security", "--offline=yes", "--no-pager", threshold, UNITS / name)
    assert done.returncode == 0, done.stdout[-300:]
    assert "Overall exposure level" in done.stdout


def test_a_service_without_a_sandbox_would_be_told(tmp_path):
    (tmp_path / "rhot-open.service").write_text("[Service]\nExecStart=/bin/true\n")
    threshold = f"--threshold={MAX_EXPOSURE}"
    done = analyze("security", "--offline=yes", threshold, tmp_path / "rhot-open.service")
    assert done.returncode != 0


@pytest.mark.parametrize("name", SERVICES)
def test_only_what_reads_cameras_and_usb_trackers_gets_devices(name):
    text = (UNITS / name).read_text()
    has_devices = "DeviceAllow=" in text
    assert has_devices == (name in ("rhot-pi-tracker@.service", "rhot-object-tracker.service"))
    assert has_devices != ("PrivateDevices=yes" in text)


def test_the_bridge_is_a_unit_of_the_user_who_is_logged_in(tmp_path):
    (path,) = USER_UNITS.glob("*")
    assert path.name == "rhot-openvr-bridge.service"
    text = path.read_text()
    command = "ExecStart=/opt/rhot/current/bin/rhot-openvr-bridge --config /etc/rhot/rig.toml\n"
    assert command in text
    # What a user's manager lacks the right to, it would refuse at the start, not here.
    assert not re.search(r"^(User|Group|Private\w+|Protect\w+|DynamicUser)=", text, re.MULTILINE)
    here = tmp_path / path.name
    here.write_text(re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", text, flags=re.MULTILINE))
    done = analyze("--user", "verify", here, XDG_RUNTIME_DIR=str(tmp_path))
    assert (done.returncode, done.stdout + done.stderr) == (0, "")
    here.write_text(here.read_text().replace("NoNewPrivileges", "NoNewPrivilegs"))
    done = analyze("--user", "verify", here, XDG_RUNTIME_DIR=str(tmp_path))
    assert "NoNewPrivilegs" in done.stderr
