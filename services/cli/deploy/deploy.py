"""`rhot deploy HOST`: install.sh on another machine of the rig, over ssh, with the rig's one
rig.toml.

It uses the system's OpenSSH, so that ~/.ssh/config, keys and known hosts count as always.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig
from rhot.process.lifecycle import EXIT_USER
from services.cli.deploy import plan, staging
from services.cli.deploy.plan import HERE, STAGED, Machine


@dataclass(frozen=True)
class Order:
    """What is the same for every machine."""

    config: RigConfig
    rig_toml: Path
    wheels: Path | None
    master: str
    replace: bool
    ssh_config: Path | None
    dry_run: bool


def deploy(
    config: Annotated[Path, typer.Option("--config", help="rig.toml of the rig")],
    host: Annotated[
        str | None, typer.Argument(help=f"as ssh calls it, or `{HERE}` for this machine")
    ] = None,
    everywhere: Annotated[
        bool, typer.Option("--all", help="this machine as master, and every host of a camera")
    ] = False,
    role: Annotated[
        str | None, typer.Option(help="pi or master; default: as rig.toml has it")
    ] = None,
    camera: Annotated[list[str] | None, typer.Option(help="default: as rig.toml has it")] = None,
    master: Annotated[
        str, typer.Option(help="the master's address, checked against rig.toml")
    ] = "",
    wheels: Annotated[
        Path | None, typer.Option(help="wheels to install from, without a network there")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="the master serves this rig instead of its first one")
    ] = False,
    ssh_config: Annotated[Path | None, typer.Option(help="instead of ~/.ssh/config")] = None,
    dry_run: Annotated[bool, typer.Option(help="print each command, run none")] = False,
) -> None:
    """Install rhot on the machines of a rig, with its rig.toml and certificates."""
    order = Order(load_rig(config), config, wheels, master, replace, ssh_config, dry_run)
    failed = [
        one.host for one in _machines(order, host, everywhere, role, camera) if _deploy(one, order)
    ]
    if failed:
        typer.echo(f"rhot deploy: failed on {', '.join(failed)}", err=True)
        raise typer.Exit(EXIT_USER)


def _machines(
    order: Order, host: str | None, everywhere: bool, role: str | None, cameras: list[str] | None
) -> list[Machine]:
    if everywhere == (host is not None):
        raise ConfigError("which machine? a HOST, or --all for all of rig.toml")
    if host is None:
        if role or cameras:
            raise ConfigError("--role and --camera go with one HOST, not with --all")
        return plan.all_machines(order.config)
    known: Literal["pi", "master"] | None = None
    match role:
        case "pi" | "master":
            known = role
        case str():
            raise ConfigError(f"there is no role {role!r}; valid: pi, master")
    return [plan.machine(order.config, host, known, cameras or ())]


def _deploy(of: Machine, order: Order) -> int:
    """Bring rhot to one machine; 0, or the code of the command that failed."""
    what = " ".join((of.role, *of.cameras))
    typer.echo(f"{of.host}: {what}")
    files = staging.wheels_for(of, order.wheels) if order.wheels else []
    staging.certificate_files(of, order.config)
    # What each needs is looked for first; the folder holds a key, and only its owner may look.
    with tempfile.TemporaryDirectory(prefix="rhot-deploy-") as name:
        folder = Path(name) / "files"
        if not order.dry_run:
            folder.mkdir()
            staging.stage(of, order.config, order.rig_toml, files, folder)
        wheels = "--wheels" if order.wheels else "--wheel"
        where = str(folder) if of.host == HERE else STAGED
        install = plan.install_command(
            of, where, wheels=wheels, master=order.master, replace=order.replace
        )
        if of.host == HERE:
            return _run([plan.local_command(install, root=os.geteuid() == 0)], order.dry_run)
        options = _ssh_options(order, Path(name))
        return _run(plan.remote_commands(of, str(folder), options, install), order.dry_run)


def _ssh_options(order: Order, folder: Path) -> list[str]:
    """One connection for all commands: a password or a passphrase is asked for once."""
    shared = ["ControlMaster=auto", f"ControlPath={folder}/%C", "ControlPersist=30"]
    own = ["-F", str(order.ssh_config)] if order.ssh_config else []
    return [*own, *(word for option in shared for word in ("-o", option))]


def _run(commands: Sequence[Sequence[str]], dry_run: bool) -> int:
    """Run commands until one fails, and the last in any case; the first code that is not 0."""
    code = 0
    for number, command in enumerate(commands):
        if dry_run:
            typer.echo(f"  $ {shlex.join(command)}")
        elif code == 0 or number == len(commands) - 1:
            # scp and ssh -t say themselves what is wrong.
            done = subprocess.run(
                command, check=False, stdin=None if sys.stdin.isatty() else subprocess.DEVNULL
            )
            code = code or done.returncode
    return code
