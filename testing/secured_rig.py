"""A rig with real certificates and a router with roles, on loopback."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path

from rhot.bus.security.credentials import with_certificates
from rhot.bus.security.roles import Role
from rhot.files.config import RigConfig, load_rig
from services.cli.pki.certificates import Issued, issue, make_authority
from services.cli.pki.folders import PkiFolder
from services.cli.pki.hosts import wanted_certificates
from testing.loopback import free_port

NOW = datetime.datetime.now(datetime.UTC)
LONG_AGO = NOW - datetime.timedelta(days=800)

_RIG = """
[rig]
name = "{name}"
[bus]
connect = ["tcp/127.0.0.1:{open_port}", "tls/127.0.0.1:{port}"]
listen = ["tcp/127.0.0.1:{open_port}", "tls/127.0.0.1:{port}"]
certificates = "hosts/master"
viewers = ["laptop"]
object_sources = ["steamvr"]
routers = {routers}
partners = {partners}
[[camera]]
name = "left"
host = "pi-left"
[[camera]]
name = "right"
host = "pi-right"
[hand.right.markers]
index_tip = "blue"
"""


class SecuredRig:
    """rig.toml and certificates in a folder, and the endpoints of each host."""

    def __init__(
        self,
        folder: Path,
        name: str = "desk",
        *,
        routers: Sequence[str] = (),
        partners: Sequence[str] = (),
        authority: Issued | None = None,
    ) -> None:
        self.folder, self.open_port, self.port = folder, free_port(), free_port()
        self.authority = authority or make_authority(name, NOW)
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / "rig.toml"
        self.path.write_text(
            _RIG.format(
                name=name,
                open_port=self.open_port,
                port=self.port,
                routers=list(routers),
                partners=list(partners),
            )
        )
        self.config: RigConfig = load_rig(self.path)
        self.hosts = PkiFolder(folder / "hosts")
        for one in wanted_certificates(self.config, "here"):
            self.make(one.name, one.role, one.hosts)

    def make(
        self,
        name: str,
        role: Role,
        hosts: Sequence[str] = (),
        *,
        at: datetime.datetime = NOW,
        authority: Issued | None = None,
        folder: str = "",
    ) -> Path:
        """Write a host's certificate, made at that time by that authority."""
        issued = issue(authority or self.authority, role, name, hosts, at)
        return self.hosts.write_host(folder or name, issued, self.authority)

    @property
    def open(self) -> list[str]:
        """The endpoint without certificates."""
        return [f"tcp/127.0.0.1:{self.open_port}"]

    def as_host(self, folder: str, address: str = "127.0.0.1") -> list[str]:
        """The endpoint as a host of that folder reaches it."""
        endpoint = f"tls/{address}:{self.port}"
        return with_certificates([endpoint], self.hosts.host(folder), "connect")
