"""A computer in a container: this machine's system (an overlay of /) with a systemd of its own.

The overlay is mounted in a mount namespace that belongs to the container alone, and what the host
writes lies in memory: when the container's process dies, by whatever, mounts and processes are
gone. Its disk (the overlay's upper layer) outlives a reboot, and goes with `remove()`.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path

from testing.hosts.commands import run

# What this machine starts at boot, and a host of a test must not, beside what it enabled itself: it
# has its network already, nobody logs in, and its devices are this machine's.
_MASKED = (
    "console-getty.service",
    "getty.target",
    "systemd-networkd.service",
    "systemd-networkd.socket",
    "systemd-resolved.service",
    "systemd-timesyncd.service",
    "systemd-logind.service",
    "systemd-udevd.service",
    "systemd-udev-trigger.service",
    "systemd-update-utmp.service",
)
_UNITS = Path("/etc/systemd/system")
# Of a command inside: nothing of this machine's user.
_ENVIRONMENT = {
    "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
    "HOME": "/root",
    "LANG": "C.UTF-8",
    "SYSTEMD_PAGER": "",
    "SYSTEMD_COLORS": "0",
}
# The network's settings are the namespace's own: a host sets them as a computer does.
_NSPAWN = {
    "SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1",
    "SYSTEMD_NSPAWN_API_VFS_WRITABLE": "network",
}
_BOOT_S, _STOP_S = 60.0, 40.0
# The overlay is mounted below the mount point $1 from the disk $2; what follows becomes nspawn.
_MOUNT_AND_BOOT = """
set -e
mount --make-rprivate /
mount -t overlay overlay -o "lowerdir=/,upperdir=$2/upper,workdir=$2/work" "$1"
shift 2
exec "$@"
"""


class Container:
    """One host. Its disk lies in memory: an overlay of / cannot have its upper layer in /."""

    def __init__(
        self,
        name: str,
        namespace: Path,
        shown: Mapping[Path, str] | None = None,
        memory: Path = Path("/dev/shm"),
    ) -> None:
        """shown: folders of this machine, and where the host has them, read-only."""
        self.name = name
        self._shown = dict(shown or {})
        self._namespace = namespace
        self._folder = Path(tempfile.mkdtemp(prefix=f"host-{os.getpid()}-{name}-", dir=memory))
        self._process: subprocess.Popen[bytes] | None = None
        self._leader = 0
        self.disk = self._folder / "upper"
        for folder in (self.disk, self._folder / "work", self._folder / "root"):
            folder.mkdir()
        units = self.disk / _UNITS.relative_to("/")
        units.mkdir(parents=True)
        wanted = {path.name for path in _UNITS.glob("*.wants/*")}
        enabled = {name for name in wanted if not name.endswith(".target")}
        for unit in sorted(enabled.union(_MASKED)):
            (units / unit).symlink_to("/dev/null")
        (self.disk / "etc/hostname").write_text(f"{name}\n")
        (self.disk / "etc/machine-id").write_text(f"{uuid.uuid4().hex}\n")

    def write(self, path: str, text: str) -> None:
        """A file on the host's disk; only while it is off."""
        target = self.disk / path.lstrip("/")
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text)

    def boot(self) -> float:
        """Start the host; returns the seconds until systemd had started all it wants."""
        began_s = time.monotonic()
        log = (self._folder / "console.log").open("ab")
        nspawn = (
            *("systemd-nspawn", "-q", "-D", self._folder / "root", "--boot"),
            *("--keep-unit", "--register=no", f"--machine={self.name}"),
            *(f"--network-namespace-path={self._namespace}", "--resolv-conf=off"),
            # A container may not lock memory by default; a computer may.
            *("--system-call-filter=@memlock", "--timezone=off"),
            *(f"--bind-ro={source}:{target}" for source, target in self._shown.items()),
        )
        # Should this process be killed, the container goes, too: unshare dies with it, the first
        # process of the namespace with unshare, and all the others with that.
        namespace = ("unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc")
        wrapper = ("setpriv", "--pdeathsig", "KILL", *namespace, "sh", "-c")
        words = (*wrapper, _MOUNT_AND_BOOT, "sh", self._folder / "root", self._folder, *nspawn)
        self._process = subprocess.Popen(
            [str(word) for word in words],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            env=_ENVIRONMENT | _NSPAWN,
            start_new_session=True,
        )
        log.close()
        self._wait_for_boot(began_s + _BOOT_S)
        return time.monotonic() - began_s

    def _wait_for_boot(self, deadline_s: float) -> None:
        state = ""
        while time.monotonic() < deadline_s:
            if self._process is None or self._process.poll() is not None:
                break
            self._leader = self._leader or self._find_leader()
            if self._leader:
                state = self.try_run("systemctl", "is-system-running").strip()
                if state in ("running", "degraded"):
                    return
            time.sleep(0.05)
        console = (self._folder / "console.log").read_text(errors="replace")
        raise RuntimeError(f"{self.name} did not boot: {state}\n{console[-4000:]}")

    def _find_leader(self) -> int:
        """The container's init: the child of systemd-nspawn that is number 1 to itself; 0: none."""
        for nspawn in self._nspawn():
            for child in _children(nspawn):
                status = _read(Path(f"/proc/{child}/status"))
                if re.search(r"^NSpid:.*\t1$", status, re.MULTILINE) and "systemd" in status[:40]:
                    return child
        return 0

    def _nspawn(self) -> list[int]:
        """Process id of systemd-nspawn, the first process of the namespace that unshare made."""
        return _children(self._process.pid) if self._process is not None else []

    @property
    def leader(self) -> int:
        """Process id, on this machine, of the host's init; 0 while it is off."""
        return self._leader

    def inside(self, *command: str | Path) -> list[str]:
        """The words that run a command on the host, as root, from here."""
        return ["nsenter", "-t", str(self._leader), "-a", "--", *map(str, command)]

    def run(self, *command: str | Path, timeout_s: float = 60.0) -> str:
        """What a command on the host said; raises RuntimeError if it fails."""
        return run(self.inside(*command), timeout_s, _ENVIRONMENT)

    def try_run(self, *command: str | Path, timeout_s: float = 60.0) -> str:
        """As run(), whatever its exit code."""
        return run(self.inside(*command), timeout_s, _ENVIRONMENT, check=False)

    def show(self, unit: str, *properties: str) -> dict[str, str]:
        """Properties of a unit, as `systemctl show` has them."""
        said = self.run("systemctl", "show", unit, *(f"--property={one}" for one in properties))
        return dict(line.split("=", 1) for line in said.splitlines() if "=" in line)

    def restarts(self) -> int:
        """How often systemd has restarted a service of rhot since the host booted."""
        said = self.run("systemctl", "show", "rhot-*.service", "--property=NRestarts", "--value")
        return sum(int(line) for line in said.split())

    def kill(self, unit: str, number: signal.Signals) -> None:
        """A signal to the main process of a unit."""
        pid = self.show(unit, "MainPID")["MainPID"]
        self.run("kill", f"-{number.name}", pid)

    def journal(self, *options: str) -> str:
        """The host's journal."""
        return self.try_run("journalctl", "--no-pager", "-o", "short-precise", *options)

    def processes(self, user: str) -> list[str]:
        """Processes of a user on the host: process id and command."""
        said = self.try_run("ps", "-u", user, "-o", "pid=,args=")
        return [line.strip() for line in said.splitlines() if line.strip()]

    def power_off(self) -> None:
        """Shut the host down in order; its disk stays. Kills it if that takes too long."""
        if self._process is None:
            return
        for nspawn in self._nspawn():
            # What it takes as the power button.
            os.kill(nspawn, signal.SIGTERM)
        try:
            self._process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise RuntimeError(f"{self.name} did not power off within {_STOP_S} s") from None
        finally:
            self._process, self._leader = None, 0

    def pull_the_plug(self) -> None:
        """Power gone: every process of the host dies at once; its disk stays."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process, self._leader = None, 0

    def remove(self) -> None:
        """Power gone, and the disk removed."""
        self.pull_the_plug()
        shutil.rmtree(self._folder, ignore_errors=True)


def _read(path: Path) -> str:
    """A file of /proc; empty if its process is gone."""
    try:
        return path.read_text()
    except OSError:
        return ""


def _children(pid: int) -> list[int]:
    return [int(word) for word in _read(Path(f"/proc/{pid}/task/{pid}/children")).split()]


def copy_in(container: Container, source: Path, target: str) -> None:
    """Copy a file or folder of this machine to a path on a host that runs."""
    with subprocess.Popen(
        ["tar", "-C", str(source.parent), "-c", source.name], stdout=subprocess.PIPE
    ) as packing:
        words: Sequence[str] = container.inside("tar", "-C", target, "-x", "--no-same-owner")
        done = subprocess.run(words, stdin=packing.stdout, env=_ENVIRONMENT, check=False)
    if done.returncode or packing.returncode:
        raise RuntimeError(f"{source} could not be copied to {container.name}:{target}")
