"""`rhot pki init|issue|renew|list`: certificates for a rig on a network."""

from __future__ import annotations

import datetime
import socket
from pathlib import Path
from typing import Annotated

import typer

from rhot.bus.security.roles import MASTER, ROLES
from rhot.errors import BusError
from rhot.files.config import load_rig
from services.cli.options import menu
from services.cli.pki.certificates import (
    Issued,
    hosts_of,
    identity_of,
    issue,
    make_authority,
    name_of,
    new_key,
)
from services.cli.pki.folders import AUTHORITY, PkiFolder
from services.cli.pki.hosts import Wanted, master_hosts, wanted_certificates, with_local

FOLDER = "pki-hosts"

ConfigOption = Annotated[Path, typer.Option("--config", help="rig.toml of the rig")]
FolderOption = Annotated[
    Path | None,
    typer.Option("--folder", help=f"where the files are; default: {FOLDER} beside rig.toml"),
]
HostOption = Annotated[
    list[str] | None,
    typer.Option("--host", help="one more name or address by which others reach the host"),
]

pki = menu("pki", "Certificates for a rig on a network.")


@pki.command(name="init")
def init(config: ConfigOption, folder: FolderOption = None, host: HostOption = None) -> None:
    """Make an authority, and certificates for the master and every host that rig.toml names.

    --host gives the master further names or addresses.
    """
    rig = load_rig(config)
    where = _where(folder, config)
    authority = make_authority(rig.rig.name, _now())
    # All are made before the first is written: a wrong name leaves no half of a folder behind.
    wanted = wanted_certificates(rig, socket.gethostname(), host or [])
    made = [(one, _issue(authority, one)) for one in wanted]
    where.write_authority(authority)
    for one, issued in made:
        _say(where.write_host(one.name, issued, authority), issued)
    typer.echo(
        f"\nCopy each folder to its host, as {rig.bus.certificates}/ beside its rig.toml. "
        f"{where.path / AUTHORITY} stays here: who has its ca.key can make certificates."
    )


@pki.command(name="issue")
def issue_one(
    name: Annotated[str, typer.Argument(help="name of the camera, viewer or other host")],
    role: Annotated[str, typer.Option(help=f"what it may do: {', '.join(ROLES)}")] = "camera",
    host: HostOption = None,
    config: ConfigOption = Path("rig.toml"),
    folder: FolderOption = None,
) -> None:
    """Make a certificate for one more host."""
    known = next((one for one in ROLES if one == role), None)
    if known is None:
        raise BusError(f"there is no role {role!r}; valid: {', '.join(ROLES)}")
    if (known == "master") != (name == MASTER):
        raise BusError(f"the certificate of role master is called {MASTER}, and no other is")
    where = _where(folder, config)
    authority = where.authority()
    if name != AUTHORITY and where.host(name).exists():
        raise BusError(
            f"{where.host(name)} exists already; `rhot pki renew {name}` makes it last longer"
        )
    hosts = host or []
    names = master_hosts(socket.gethostname(), hosts) if known == "master" else with_local(hosts)
    issued = _issue(authority, Wanted(name, known, names))
    _say(where.write_host(name, issued, authority), issued)
    table = {"viewer": "viewers", "objects": "object_sources"}.get(known)
    if table:
        typer.echo(
            f"Add {name!r} to `[bus] {table}` of the router's rig.toml and restart the router: "
            "until then it is a stranger."
        )


@pki.command(name="renew")
def renew(
    names: Annotated[list[str] | None, typer.Argument(help="whose; default: everybody's")] = None,
    new_keys: Annotated[
        bool, typer.Option("--new-key", help="new keys, too: where one may be known to others")
    ] = False,
    host: HostOption = None,
    config: ConfigOption = Path("rig.toml"),
    folder: FolderOption = None,
) -> None:
    """Make certificates last longer, for the keys that hosts have. --host goes to the master."""
    where = _where(folder, config)
    authority = where.authority()
    everybody = [name for name, _ in where.certificates()][1:]
    made = []
    for name in names or everybody:
        old = where.read_host(name)
        who = identity_of(old.certificate)
        if who is None:
            raise BusError(
                f"the certificate in {where.host(name)} is named {name_of(old.certificate)!r}, "
                f"which `rhot pki` would not; remove the folder and `rhot pki issue {name}`"
            )
        more = (host or []) if who.role in ("master", "router") else []
        hosts = [*hosts_of(old.certificate), *with_local(more)]
        key = new_key() if new_keys else old.key
        made.append((name, issue(authority, who.role, who.name, hosts, _now(), key)))
    for name, issued in made:
        _say(where.write_host(name, issued, authority), issued)
    files = "own.pem and own.key" if new_keys else "own.pem"
    typer.echo(f"\nBring {files} of each to its host's pki/, and restart what runs there.")


@pki.command(name="list")
def list_all(config: ConfigOption = Path("rig.toml"), folder: FolderOption = None) -> None:
    """Show all certificates: name, role, the day they end, days left, hosts they hold for."""
    now = _now()
    typer.echo(f"{'FOLDER':16} {'ROLE':10} {'ENDS':11} {'DAYS LEFT':>9}  HOSTS")
    for name, certificate in _where(folder, config).certificates():
        who = identity_of(certificate)
        ends = certificate.not_valid_after_utc
        hosts = ", ".join(hosts_of(certificate)) or "-"
        role = who.role if who else "authority"
        typer.echo(f"{name:16} {role:10} {ends:%Y-%m-%d}  {(ends - now).days:9}  {hosts}")


def _where(folder: Path | None, config: Path) -> PkiFolder:
    return PkiFolder(folder or config.parent / FOLDER)


def _now() -> datetime.datetime:
    return datetime.datetime.now(datetime.UTC)


def _issue(authority: Issued, wanted: Wanted) -> Issued:
    return issue(authority, wanted.role, wanted.name, wanted.hosts, _now())


def _say(folder: Path, issued: Issued) -> None:
    ends = f"{issued.certificate.not_valid_after_utc:%Y-%m-%d}"
    typer.echo(f"{folder}: {name_of(issued.certificate)}, until {ends}")
