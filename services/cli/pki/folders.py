"""The files of an authority and its hosts: one folder each, ready to be copied.

`<folder>/authority/` holds ca.pem and ca.key, and stays where it is; `<folder>/<name>/` holds
ca.pem, own.pem and own.key, and is copied to its host as `pki/` beside rig.toml. Keys are readable
by their owner alone from the moment they exist.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from cryptography import x509

from rhot.bus.security.credentials import CA, CERTIFICATE, KEY
from rhot.errors import BusError
from services.cli.pki.certificates import Issued, read_issued

AUTHORITY = "authority"
_CA_KEY = "ca.key"


class PkiFolder:
    """The folder in which `rhot pki` keeps everything."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def host(self, name: str) -> Path:
        """The folder of one host, ready to be copied."""
        return self.path / name

    def write_authority(self, authority: Issued) -> None:
        """Keep a new authority; raises BusError if there is one already."""
        folder = self.path / AUTHORITY
        if (folder / CA).exists() or (folder / _CA_KEY).exists():
            raise BusError(
                f"there is an authority in {folder} already; add a host with `rhot pki issue NAME`,"
                " or move that folder away to begin anew (every host needs new files then)"
            )
        _make_private(folder)
        _write(folder / _CA_KEY, authority.key_pem, 0o600)
        _write(folder / CA, authority.certificate_pem, 0o644)

    def authority(self) -> Issued:
        """The authority; raises BusError if there is none, or it is damaged."""
        folder = self.path / AUTHORITY
        return _read(folder / CA, folder / _CA_KEY, "make one with `rhot pki init`")

    def write_host(self, name: str, issued: Issued, authority: Issued) -> Path:
        """Write the three files of a host, over older ones; its folder."""
        if name == AUTHORITY:
            raise BusError(f"a host cannot be called {AUTHORITY!r}; choose another name")
        folder = self.host(name)
        _make_private(folder)
        _write(folder / KEY, issued.key_pem, 0o600)
        _write(folder / CERTIFICATE, issued.certificate_pem, 0o644)
        _write(folder / CA, authority.certificate_pem, 0o644)
        return folder

    def read_host(self, name: str) -> Issued:
        """A host's certificate and key; raises BusError if they are missing or damaged."""
        folder = self.host(name)
        return _read(folder / CERTIFICATE, folder / KEY, f"make them with `rhot pki issue {name}`")

    def certificates(self) -> Iterator[tuple[str, x509.Certificate]]:
        """Name of folder and certificate: the authority's, then the hosts' by name."""
        own = [(AUTHORITY, self.path / AUTHORITY / CA)]
        hosts = [(path.parent.name, path) for path in sorted(self.path.glob(f"*/{CERTIFICATE}"))]
        for name, path in own + hosts:
            if not path.exists():
                raise BusError(f"no certificates in {self.path}; make them with `rhot pki init`")
            try:
                yield name, x509.load_pem_x509_certificate(path.read_bytes())
            except (OSError, ValueError) as error:
                raise BusError(f"{path} is no certificate: {error}") from None


def _read(certificate: Path, key: Path, advice: str) -> Issued:
    try:
        return read_issued(certificate.read_bytes(), key.read_bytes())
    except (OSError, ValueError, TypeError) as error:
        raise BusError(f"{certificate} and {key} cannot be used: {error}; {advice}") from None


def _make_private(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    folder.chmod(0o700)


def _write(path: Path, content: bytes, mode: int) -> None:
    """Write a file whole or not at all, never readable by more than mode says."""
    new = path.with_name(f"{path.name}.new")
    new.unlink(missing_ok=True)
    with os.fdopen(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)
