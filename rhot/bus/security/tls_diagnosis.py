"""Why a certificate is no good, in words: Zenoh itself says only that it could not connect.

The standard library alone (a Pi has no more): what a certificate says is read in a TLS handshake
within this process, in which the host shows its certificate to its own authority, and what a router
says in a handshake with it. OpenSSL judges in both, as Zenoh's own TLS does.
"""

from __future__ import annotations

import contextlib
import os
import socket
import ssl
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rhot.bus.security.credentials import Credentials, credentials_in, is_secured, plain
from rhot.errors import BusError

# A router on the same network answers within milliseconds.
_TIMEOUT_S = 2.0
# OpenSSL's X509_V_FLAG_NO_CHECK_TIME, which the ssl module does not name: a certificate that has
# ended can be read, too.
_NO_CHECK_TIME = 0x200000
_BRING = "bring ca.pem, own.pem and own.key of this host from the folder that `rhot pki` made"


@dataclass(frozen=True)
class OwnCertificate:
    """What this host's certificate says. Seconds are of CLOCK_REALTIME."""

    common_name: str
    starts_s: float
    ends_s: float

    def days_left(self, now_s: float) -> float:
        """Days until it ends; negative once it has."""
        return (self.ends_s - now_s) / 86400.0

    @property
    def end_date(self) -> str:
        """The day on which it ends, in UTC."""
        return time.strftime("%Y-%m-%d", time.gmtime(self.ends_s))


def read_own_certificate(files: Credentials) -> OwnCertificate:
    """This host's certificate, whether or not it is valid today.

    Raises BusError if a file is missing, unreadable or damaged, if the key may be read by everybody
    or belongs to another certificate, or if the certificate is not of the authority in ca.pem.
    """
    for path in (files.ca, files.certificate, files.key):
        _check_readable(path)
    if problem := exposed_key(files):
        raise BusError(problem)
    try:
        found = _shown_to_own_authority(files)
    except ssl.SSLCertVerificationError as error:
        raise BusError(
            f"{files.certificate} is not of the authority in {files.ca} "
            f"({error.verify_message}); {_BRING}"
        ) from None
    except (ssl.SSLError, ValueError) as error:
        raise BusError(
            f"{files.certificate}, {files.key} and {files.ca} are damaged or do not belong "
            f"together ({_reason(error)}); {_BRING}"
        ) from None
    return OwnCertificate(
        _common_name(found),
        ssl.cert_time_to_seconds(found["notBefore"]),
        ssl.cert_time_to_seconds(found["notAfter"]),
    )


def exposed_key(files: Credentials) -> str | None:
    """What is wrong if everybody on this computer may read the private key; else None.

    Windows has other rights, which a file's mode does not tell.
    """
    if os.name != "posix":
        return None
    with contextlib.suppress(OSError):  # missing: found where it is read
        if files.key.stat().st_mode & 0o007:
            return (
                f"everybody on this computer may read the private key {files.key}; "
                f"run `chmod 600 {files.key}`"
            )
    return None


def own_problem(files: Credentials, now_s: float) -> str | None:
    """What is wrong with this host's certificate, or None. now_s is CLOCK_REALTIME."""
    try:
        own = read_own_certificate(files)
    except BusError as error:
        return str(error)
    if now_s >= own.ends_s:
        return (
            f"this host's certificate {own.common_name} ({files.certificate}) ended on "
            f"{own.end_date}; run `rhot pki renew` and bring the new own.pem here"
        )
    if now_s < own.starts_s:
        return (
            f"this host's certificate {own.common_name} is not valid yet: this computer believes "
            f"it is {time.strftime('%Y-%m-%d', time.gmtime(now_s))}; set its clock"
        )
    return None


def certificate_problem(endpoints: list[str], now_s: float) -> str | None:
    """Why none of these endpoints can be reached, if a certificate is the reason; else None.

    Blocks for two seconds an endpoint at most.
    """
    for endpoint in endpoints:
        if not is_secured(endpoint):
            continue
        files = credentials_in(endpoint)
        if files is None:
            return (
                f"{plain(endpoint)} needs certificates: name their folder in `[bus] certificates` "
                "of rig.toml, or with `certificates=`"
            )
        problem = own_problem(files, now_s)
        if problem is None and endpoint.startswith("tls/"):
            problem = _router_problem(plain(endpoint).removeprefix("tls/"), files)
        if problem is not None:
            return problem
    return None


def _router_problem(address: str, files: Credentials) -> str | None:
    host, _, port = address.rpartition(":")
    host = host.strip("[]")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.load_verify_locations(files.ca)
    context.load_cert_chain(files.certificate, files.key)
    try:
        _shake_hands(context, host, int(port))
    except ssl.SSLCertVerificationError as error:
        return f"the router at {address} is not to be trusted: {_untrusted(error, host, files)}"
    except ssl.SSLError as error:
        # A router that dies meanwhile ends the handshake, too, but without a verdict.
        if "alert" not in _reason(error):
            return None
        return (
            f"the router at {address} refuses this host's certificate {files.certificate} "
            f"({_reason(error)}): it believes in another authority, or its clock is wrong; "
            f"`rhot pki list` shows which it should have, then {_BRING}"
        )
    except (
        OSError,
        ValueError,
    ):  # nobody there, no such host, no such port: no certificate's fault
        return None
    return None


def _shake_hands(context: ssl.SSLContext, host: str, port: int) -> None:
    with (
        socket.create_connection((host, port), _TIMEOUT_S) as raw,
        context.wrap_socket(raw, server_hostname=host) as link,
    ):
        # In TLS 1.3 the router's verdict on our certificate comes after the handshake; one
        # that is content says nothing before we do.
        link.settimeout(0.3)
        with contextlib.suppress(TimeoutError, ConnectionError):
            link.recv(1)


def _untrusted(error: ssl.SSLCertVerificationError, host: str, files: Credentials) -> str:
    # OpenSSL's X509_V_ERR codes: 10 expired, 9 not yet valid, 62 and 64 another name or address.
    match error.verify_code:
        case 10:
            return "its certificate has ended; run `rhot pki renew` and bring the new file to it"
        case 9:
            return "its certificate is not valid yet: this computer's clock is wrong; set it"
        case 62 | 64:
            return (
                f"its certificate does not hold for the name {host}; connect by a name that "
                f"`rhot pki list` shows, or `rhot pki renew --host {host}` for the master"
            )
    return (
        f"its certificate is not of the authority in {files.ca} ({error.verify_message}); {_BRING}"
    )


def _check_readable(path: Path) -> None:
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise BusError(
            f"the certificate file {path} cannot be read: {os.strerror(error.errno or 0)}; {_BRING}"
        ) from None


def _shown_to_own_authority(files: Credentials) -> dict[str, Any]:
    """The host's certificate as OpenSSL reads it, checked against ca.pem, whatever the date."""
    host = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    host.check_hostname, host.verify_mode = False, ssl.CERT_NONE
    authority = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    authority.verify_mode = ssl.CERT_REQUIRED
    authority.verify_flags |= _NO_CHECK_TIME
    authority.load_verify_locations(files.ca)
    for context in (host, authority):
        context.load_cert_chain(files.certificate, files.key)
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    asks = host.wrap_bio(back, there)
    judges = authority.wrap_bio(there, back, server_side=True)
    # Three flights each way at most.
    for _ in range(3):
        for side in (asks, judges):
            _step(side.do_handshake)
    return dict(judges.getpeercert() or {})


def _step(handshake: Callable[[], None]) -> None:
    with contextlib.suppress(ssl.SSLWantReadError):
        handshake()


def _common_name(found: dict[str, Any]) -> str:
    pairs = [pair for name in found.get("subject", ()) for pair in name]
    return next((value for key, value in pairs if key == "commonName"), "")


def _reason(error: Exception) -> str:
    reason = getattr(error, "reason", None) or str(error)
    return str(reason).lower().replace("_", " ")
