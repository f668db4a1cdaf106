"""What `rhot deploy` does on which machine: roles, files to bring, and the commands that do it.

Pure: nothing is run, copied or read here but names.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rhot.bus.security.credentials import is_secured
from rhot.bus.security.roles import MASTER, cameras_by_certificate
from rhot.errors import ConfigError
from rhot.files.config import RigConfig

InstallRole = Literal["pi", "master"]

# This machine, which needs no ssh.
HERE = "here"
# In the home folder of the user who logs in; removed in the end, since it holds a key.
STAGED = "rhot-deploy"


@dataclass(frozen=True)
class Machine:
    """A computer of the rig: how ssh calls it ("here": not at all), its role, its cameras, and the
    name of its certificate ("" without TLS).
    """

    host: str
    role: InstallRole
    cameras: tuple[str, ...]
    certificate: str


def all_machines(config: RigConfig) -> list[Machine]:
    """The master, which is this machine, and each host of a camera, in the order of rig.toml."""
    hosts = dict.fromkeys(camera.host for camera in config.camera if camera.host)
    return [machine(config, host) for host in (HERE, *hosts)]


def machine(
    config: RigConfig,
    host: str,
    role: InstallRole | None = None,
    cameras: Sequence[str] = (),
) -> Machine:
    """The machine that ssh calls `host`; role and cameras as rig.toml has them, unless given.

    Raises ConfigError if rig.toml does not say what the host is for.
    """
    if host.startswith("-") or not host or any(character.isspace() for character in host):
        raise ConfigError(f"{host!r} is no host; e.g. pi-left.local, or pi@192.168.1.11")
    address = host.rpartition("@")[2]
    its = tuple(cameras) or tuple(c.name for c in config.camera if c.host and c.host == address)
    for name in its:
        config.camera_named(name)
    if role is None:
        role = "pi" if its else "master" if host == HERE else None
    if role is None or (role == "pi" and not its):
        known = sorted({camera.host for camera in config.camera if camera.host})
        raise ConfigError(
            f"no [[camera]] of rig.toml has the host {address!r} (it has {known}); "
            "correct rig.toml, or say what the machine is: --camera NAME, or --role master"
        )
    secured = any(is_secured(endpoint) for endpoint in config.bus.connect)
    return Machine(
        host, role, its if role == "pi" else (), _certificate(config, role, its, secured)
    )


def _certificate(
    config: RigConfig, role: InstallRole, cameras: tuple[str, ...], secured: bool
) -> str:
    if not secured:
        return ""
    if role == "master":
        return MASTER
    names = cameras_by_certificate(config)
    return next(name for name, its in names.items() if cameras[0] in its)


def calibrations(config: RigConfig, of: Machine) -> list[Path]:
    """Calibration files that the machine may need; those it has already are not replaced."""
    files = sorted(config.calibration_dir.glob("*.json"))
    if of.role == "master":
        return files
    return [path for path in files if path.name.split(".")[0] in of.cameras]


def install_command(
    of: Machine, folder: str, *, wheels: str, master: str = "", replace: bool = False
) -> list[str]:
    """install.sh with its options, for files staged in `folder`.

    wheels is "--wheels" for a folder that holds all of them, "--wheel" if it holds rhot's alone;
    replace: of a master, which serves another rig no more then.
    """
    command = [f"{folder}/deploy/install.sh", of.role, *of.cameras]
    if master:
        command += ["--master", master]
    command += ["--config", f"{folder}/rig.toml", wheels, f"{folder}/wheels"]
    if of.certificate:
        command += ["--pki", f"{folder}/pki"]
    if replace and of.role == "master":
        command.append("--replace")
    return command


def remote_commands(
    of: Machine, local: str, ssh_options: Sequence[str], install: Sequence[str]
) -> list[list[str]]:
    """Copy what is staged in the folder `local`, install it, remove the copy; in this order.

    The last one is run whatever became of the others.
    """
    ssh = ["ssh", *ssh_options]
    # A user who is root needs no sudo, and may have none.
    as_root = f'S=$(test "$(id -u)" = 0 || echo sudo); $S {shlex.join(install)}'
    return [
        [*ssh, "--", of.host, f"rm -rf {STAGED} && mkdir -m 700 {STAGED}"],
        ["scp", *ssh_options, "-q", "-r", f"{local}/.", f"{of.host}:{STAGED}/"],
        # With a terminal, where there is one here: sudo may ask for a password.
        [*ssh, "-t", "--", of.host, as_root],
        [*ssh, "--", of.host, f"rm -rf {STAGED}"],
    ]


def local_command(install: Sequence[str], *, root: bool) -> list[str]:
    """The same on this machine."""
    return list(install) if root else ["sudo", *install]
