"""A whole rig on hosts of its own: a master and two Pis, installed by deploy/install.sh.

What takes minutes is kept in build/hosts/ for the next run, where install.sh finds it as an earlier
installation: the environments if the wheels are the same, compiled kernels always. At first those
are lent that this checkout has.
"""

from __future__ import annotations

import contextlib
import hashlib
import shutil
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rhot.kernels.numba_cache import cache_folder
from testing.hosts.commands import run
from testing.hosts.container import Container, copy_in
from testing.hosts.network import Network, lan
from testing.hosts.poses import PoseWatch
from testing.hosts.rig_files import CAMERAS, NAME, write_rig
from testing.hosts.wheels import ROOT, collect

MASTER = "master"
LOOPBACK = "tcp/127.0.0.1:7447"
_KEPT = ROOT / "build" / "hosts"
# Where a host has the wheels, deploy/ and what is brought to it.
_WHEELS, _DEPLOY, _BROUGHT = "/srv/wheels", "/srv/deploy", "/srv/brought"
# A cold compilation of all kernels on a busy machine takes most of it.
_INSTALL_S = 600.0
_VERSIONS, _KERNELS = "opt/rhot/versions", "var/cache/rhot"


class HostedRig:
    """The running hosts. `watch` sees the master's bus."""

    def __init__(self, network: Network, folder: Path) -> None:
        self.network = network
        self._folder = folder
        wheels = collect(_KEPT / "wheels")
        shown = {wheels: _WHEELS, ROOT / "deploy": _DEPLOY}
        self._key = _digest_of(wheels)
        self.hosts: dict[str, Container] = {}
        for name in network.addresses:
            self.hosts[name] = Container(name, network.namespace_path(name), shown)
        self.installed: dict[str, str] = {}

    @property
    def master(self) -> Container:
        """The host with everything but the cameras."""
        return self.hosts[MASTER]

    def start(self) -> None:
        """Boot all hosts and install rhot on them, as docs/guide/install.md has it."""
        names = "".join(f"{ip} {name}\n" for name, ip in self.network.addresses.items())
        for name, host in self.hosts.items():
            host.write("/etc/hosts", f"127.0.0.1 localhost\n::1 localhost\n{names}")
            host.write(f"{_BROUGHT}/README", "What a test brings to this host.\n")
            _restore(host, self._kept(name))
            if name == MASTER:
                _restore(host, _KEPT / "kernels.tar")
                _lend_kernels(host)
            host.boot()
        config = write_rig(self._folder)
        self._bring(MASTER, config, config.parent / "calibration")
        install = (f"{_DEPLOY}/install.sh", MASTER, "--wheels", _WHEELS, "--simulator")
        self._install(MASTER, *install, "--config", f"{_BROUGHT}/rig.toml", "--no-start")
        self.master.run("/opt/rhot/current/bin/rhot", "pki", "init", "--config", _ETC_RIG)
        self._install(MASTER, *install, "--pki", "/etc/rhot/pki-hosts/master")
        with ThreadPoolExecutor(len(CAMERAS)) as pool:
            list(pool.map(self._install_pi, CAMERAS))

    def _install_pi(self, name: str) -> None:
        """Bring rig.toml, calibration and certificates to a Pi, and install it."""
        pki = self._folder / name / "pki"
        shutil.copytree(self.master.disk / "etc/rhot/pki-hosts" / name, pki)
        self._bring(name, self._folder / "rig.toml", self._folder / "calibration", pki)
        install = (f"{_DEPLOY}/install.sh", "pi", name, "--master", MASTER, "--wheels", _WHEELS)
        brought = ("--config", f"{_BROUGHT}/rig.toml", "--pki", f"{_BROUGHT}/pki")
        self._install(name, *install, *brought)

    def _install(self, name: str, *command: str) -> None:
        said = self.hosts[name].run("bash", *command, timeout_s=_INSTALL_S)
        self.installed[name] = self.installed.get(name, "") + said
        _keep(self.hosts[name], _VERSIONS, self._kept(name))
        if name == MASTER:
            _keep(self.hosts[name], _KERNELS, _KEPT / "kernels.tar")

    def _bring(self, name: str, *paths: Path) -> None:
        for path in paths:
            copy_in(self.hosts[name], path, _BROUGHT)

    def _kept(self, name: str) -> Path:
        role = MASTER if name == MASTER else "pi"
        return _KEPT / f"{role}-{self._key}.tar"

    def new_watch(self) -> PoseWatch:
        """A watch of the master's bus, from the master."""
        return PoseWatch(self.network.namespace_path(MASTER), NAME, LOOPBACK)

    def restarts(self) -> int:
        """How often systemd has restarted a service of rhot, on all hosts since they booted."""
        return sum(host.restarts() for host in self.hosts.values())

    def zenoh_get(self, key: str, value: str) -> str:
        """What the master's bus answers to a query with a payload, asked with the Zenoh CLI."""
        network = f"--net={self.network.namespace_path(MASTER)}"
        zenoh = Path(sys.executable).parent / "zenoh"
        client = (zenoh, "--mode", "client", "--connect", LOOPBACK)
        ask = ("get", "--selector", key, "--value", value, "--decoder", "text")
        return run(["nsenter", network, "--", *client, *ask])

    def journals(self) -> str:
        """The last that rhot said on every host."""
        return "\n".join(
            f"== {name}\n{host.journal('-u', 'rhot-*', '-n', '40')}"
            for name, host in self.hosts.items()
        )

    def remove(self) -> None:
        """Everything of it is gone."""
        for host in self.hosts.values():
            host.remove()


_ETC_RIG = "/etc/rhot/rig.toml"


@contextlib.contextmanager
def hosted_rig() -> Iterator[HostedRig]:
    """The rig, installed and started, for as long as the block lasts."""
    with tempfile.TemporaryDirectory(prefix="hosted-rig-") as folder, lan(MASTER, *CAMERAS) as net:
        rig = HostedRig(net, Path(folder))
        try:
            rig.start()
            yield rig
        finally:
            rig.remove()


def _digest_of(wheels: Path) -> str:
    """Of all that goes into an installation, and of the script that makes it."""
    digest = hashlib.sha256()
    for path in sorted(wheels.glob("*.whl")):
        digest.update(path.name.encode())
    (own,) = wheels.glob("rhot-*.whl")
    digest.update(own.read_bytes() + (ROOT / "deploy" / "install.sh").read_bytes())
    return digest.hexdigest()[:12]


def _restore(host: Container, kept: Path) -> None:
    if kept.exists():
        run(["tar", "-C", host.disk, "-x", "-f", kept, "--numeric-owner", "-p"])


def _lend_kernels(host: Container) -> None:
    """As if an earlier version of rhot on the host had compiled what this checkout did."""
    here = cache_folder(ROOT / "services")
    if here.is_dir():
        shutil.copytree(here, host.disk / _KERNELS / here.name, dirs_exist_ok=True)


def _keep(host: Container, folder: str, kept: Path) -> None:
    """Keep a folder of a host; what was kept of older wheels goes."""
    if kept.exists() and kept.stem != "kernels":
        return
    role, new = kept.name.partition("-")[0], kept.with_suffix(f".tar.{host.name}")
    # What another host of the same role is writing at this moment stays.
    for pattern in (f"{role}-*.tar", f"{role}-*.tar.{host.name}"):
        for old in kept.parent.glob(pattern):
            old.unlink(missing_ok=True)
    run(["tar", "-C", host.disk, "-c", "-f", new, "--numeric-owner", folder], _INSTALL_S)
    new.replace(kept)
