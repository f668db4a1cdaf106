"""A Pi's stand-in: a container with a real systemd and sshd, and a desk on the same network."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from rhot.files.calibration import save
from testing.hosts.commands import run
from testing.hosts.container import Container
from testing.hosts.network import Network, lan
from testing.source_tree import ROOT
from testing.synthetic_images import ranges

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet")
RIG = """
[bus]
connect = ["tcp/127.0.0.1:7447"]
[[camera]]
name = "left"
source = "folder:/srv/pictures"
host = "pi-left"
"""
ROUTER = """
import time, zenoh
from rhot.bus.bus import router_config
session = zenoh.open(router_config(["tcp/127.0.0.1:7447"]))
time.sleep(1e6)
"""


@pytest.fixture(scope="module")
def rig_toml() -> str:
    """A rig whose one camera is a folder of pictures on the Pi."""
    return RIG


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> tuple[Path, Path]:
    """Folders that hold all a Pi needs: with this rhot, and with one that is called 9.9.9."""
    folder = tmp_path_factory.mktemp("wheels")
    now, next_one = folder / "now", folder / "next"
    run([*PIP, "-w", now, f"{ROOT}[pi]"], timeout_s=600.0)
    tree = folder / "tree"
    roots = ("rhot", "services", "studies", "config", "deploy")
    files = run(["git", "-C", ROOT, "ls-files", *roots]).split("\n")
    for name in (*filter(None, files), "pyproject.toml", "hatch_build.py", "README.md", "LICENSE"):
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tree / name)
    text = (tree / "pyproject.toml").read_text()
    (tree / "pyproject.toml").write_text(re.sub(r'(?m)^version = ".*"', 'version = "9.9.9"', text))
    shutil.copytree(now, next_one, ignore=shutil.ignore_patterns("rhot-*"))
    run([*PIP, "--no-deps", "-w", next_one, tree], timeout_s=600.0)
    return now, next_one


@pytest.fixture(scope="module")
def network() -> Iterator[Network]:
    with lan("pi-left", "desk") as network:
        yield network


@pytest.fixture(scope="module")
def pi(network, wheels, tmp_path_factory) -> Iterator[Container]:
    """A host that has booted, and knows nothing of rhot."""
    shown = {ROOT / "deploy": "/srv/deploy", wheels[0]: "/srv/now", wheels[1]: "/srv/next"}
    host = Container("pi-left", network.namespace_path("pi-left"), shown)
    try:
        for number in range(3):
            host.write(f"/srv/pictures/{number}.ppm", "P3 2 2 255\n" + "9 9 9 " * 4)
        save(host.disk / "srv" / "left.colors.json", ranges())
        host.write("/srv/rig.toml", RIG)
        host.write("/srv/router.py", ROUTER)
        host.boot()
        yield host
    finally:
        host.remove()


@pytest.fixture
def ssh_config(pi, network) -> Iterator[Path]:
    """A daemon on the Pi, and what the desk needs to log in there as root."""
    # Not tmp_path: a path of a socket has at most 108 characters.
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for key in ("host", "user"):
            run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", folder / key])
        daemon = (
            f"Port 2222\nListenAddress {network.addresses['pi-left']}\nStrictModes no\n"
            "HostKey /srv/ssh/host\nAuthorizedKeysFile /srv/ssh/user.pub\nPidFile none\n"
            "PermitRootLogin prohibit-password\nSubsystem sftp internal-sftp\n"
        )
        (folder / "sshd").write_text(daemon)
        pi.run("mkdir", "-p", "/srv/ssh", "/run/sshd")
        for path in (folder / "host", folder / "user.pub", folder / "sshd"):
            words = pi.inside("sh", "-c", f"umask 077; cat >/srv/ssh/{path.name}")
            subprocess.run(words, input=path.read_bytes(), check=True)
        pi.run(
            "systemd-run", "-q", "--unit=ssh-test", "/usr/sbin/sshd", "-D", "-f", "/srv/ssh/sshd"
        )
        (folder / "config").write_text(
            f"Host pi-left\nHostName {network.addresses['pi-left']}\nPort 2222\nUser root\n"
            f"IdentityFile {folder}/user\nIdentitiesOnly yes\nBatchMode yes\n"
            f"StrictHostKeyChecking accept-new\nUserKnownHostsFile {folder}/known\n"
            "ConnectionAttempts 20\n"
        )
        yield folder / "config"
        pi.run("systemctl", "stop", "ssh-test")
