"""The certificates of this host, put into the endpoints that need them.

`[bus] certificates` of rig.toml is a folder with `ca.pem` (whom to believe), `own.pem` and
`own.key` (who this host is). Zenoh takes them as options of an endpoint, after a `#`; an endpoint
that has options of its own is left as it is. Pure: whether the files are any good is looked at in
rhot/bus/security/tls_diagnosis.py.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rhot.errors import BusError
from rhot.files.config import RigConfig

Side = Literal["connect", "listen"]

CA, CERTIFICATE, KEY = "ca.pem", "own.pem", "own.key"
# Zenoh's protocols that take certificates.
SECURED = ("tls", "quic")
# What separates an endpoint's options cannot stand in a file's name.
_SEPARATORS = "#;=|?"


@dataclass(frozen=True)
class Credentials:
    """The three files by which a host shows who it is, and knows whom to believe."""

    ca: Path
    certificate: Path
    key: Path

    @classmethod
    def of(cls, folder: Path) -> Credentials:
        """Those of a folder that `rhot pki` made."""
        return cls(folder / CA, folder / CERTIFICATE, folder / KEY)


def client_endpoints(config: RigConfig) -> list[str]:
    """Where this host's services find the router, with this host's certificates."""
    return with_certificates(config.bus.connect, config.certificates_dir, "connect")


def router_endpoints(config: RigConfig) -> list[str]:
    """Where the router listens, with this host's certificates."""
    return with_certificates(config.bus.listen, config.certificates_dir, "listen")


def with_certificates(endpoints: Iterable[str], folder: Path | None, side: Side) -> list[str]:
    """The endpoints, those of tls and quic with the folder's files as their options.

    Without a folder they are returned as they are. Raises BusError if the folder's name cannot
    stand in an endpoint.
    """
    if folder is None:
        return list(endpoints)
    folder = folder.absolute()
    if set(_SEPARATORS) & set(str(folder)):
        raise BusError(
            f"the certificates' folder {folder} cannot be used: a path with one of "
            f"{' '.join(_SEPARATORS)} cannot stand in an endpoint; move it"
        )
    options = _options(Credentials.of(folder), side)
    return [
        f"{endpoint}#{options}" if is_secured(endpoint) and "#" not in endpoint else endpoint
        for endpoint in endpoints
    ]


def _options(files: Credentials, side: Side) -> str:
    options = [
        f"root_ca_certificate_file={files.ca}",
        f"{side}_certificate_file={files.certificate}",
        f"{side}_private_key_file={files.key}",
        "enable_mtls=true",
    ]
    return ";".join(options)


def is_secured(endpoint: str) -> bool:
    """Whether an endpoint speaks TLS."""
    return endpoint.partition("/")[0] in SECURED


def plain(endpoint: str) -> str:
    """An endpoint without its options, as people write it."""
    return endpoint.partition("#")[0]


def credentials_in(endpoint: str) -> Credentials | None:
    """The files that an endpoint's options name; None if it does not name all three."""
    options = dict(
        option.partition("=")[::2] for option in endpoint.partition("#")[2].split(";") if option
    )
    ca = options.get("root_ca_certificate_file")
    for side in ("connect", "listen"):
        own, key = options.get(f"{side}_certificate_file"), options.get(f"{side}_private_key_file")
        if ca and own and key:
            return Credentials(Path(ca), Path(own), Path(key))
    return None
