"""A rig's own certificate authority and the certificates it issues, as X.509 objects. Pure.

EC keys on P-256: what every TLS library knows, and a handshake takes a Pi 3 a few milliseconds.
"""

from __future__ import annotations

import datetime
import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from rhot.bus.security.roles import Identity, Role, common_name, identity
from rhot.errors import BusError

# The authority outlives the hardware of a rig: to replace it means to visit every host.
CA_DAYS = 3652
# A visit to each host every two years is bearable, and health tells 30 days ahead; a lost host's
# certificate cannot be called back (Zenoh reads no revocation lists), so that it should not last
# as long as the authority.
HOST_DAYS = 730
# A Pi has no clock of its own: until it has the time from the network it believes in the day of its
# last shutdown, or of its image. A certificate that begins earlier is valid on that day, too.
BACKDATED_DAYS = 365
_CA_SUFFIX = ".ca"


@dataclass(frozen=True)
class Issued:
    """A certificate with its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @property
    def certificate_pem(self) -> bytes:
        """For own.pem or ca.pem."""
        return self.certificate.public_bytes(serialization.Encoding.PEM)

    @property
    def key_pem(self) -> bytes:
        """For own.key or ca.key: PKCS8 without a password."""
        return self.key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )

    @property
    def rig(self) -> str:
        """The rig of an authority."""
        return name_of(self.certificate).removesuffix(_CA_SUFFIX)


def new_key() -> ec.EllipticCurvePrivateKey:
    """A fresh private key."""
    return ec.generate_private_key(ec.SECP256R1())


def make_authority(rig: str, now: datetime.datetime) -> Issued:
    """A certificate authority of its own for a rig."""
    key = new_key()
    name = _name(f"{rig}{_CA_SUFFIX}"[-64:])
    builder = (
        _builder(name, name, key.public_key(), now, CA_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(signs_certificates=True), critical=True)
    )
    return Issued(builder.sign(key, hashes.SHA256()), key)


def issue(
    authority: Issued,
    role: Role,
    name: str,
    hosts: Sequence[str],
    now: datetime.datetime,
    key: ec.EllipticCurvePrivateKey | None = None,
) -> Issued:
    """A host's certificate, for a key it has or for a new one.

    hosts are the names and addresses at which others reach it: clients compare them with the
    endpoint they connect to. Only a router's host is connected to, so that only `master` and
    `router` may act as a server: a camera cannot pose as the router.
    """
    own_key = key or new_key()
    usages = [ExtendedKeyUsageOID.CLIENT_AUTH]
    if role in ("master", "router"):
        usages.append(ExtendedKeyUsageOID.SERVER_AUTH)
    subject = _name(common_name(authority.rig, role, name))
    builder = (
        _builder(subject, authority.certificate.subject, own_key.public_key(), now, HOST_DAYS)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_key_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key()),
            critical=False,
        )
    )
    names = [_general_name(host) for host in dict.fromkeys(hosts)]
    if names:
        builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    return Issued(builder.sign(authority.key, hashes.SHA256()), own_key)


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    public_key: ec.EllipticCurvePublicKey,
    now: datetime.datetime,
    days: int,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(public_key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=BACKDATED_DAYS))
        .not_valid_after(now + datetime.timedelta(days=days))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public_key), critical=False)
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _key_usage(signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass
    try:
        return x509.DNSName(host)
    except ValueError:
        raise BusError(
            f"{host!r} is neither a host name nor an address; write master.local or 192.168.1.10"
        ) from None


def name_of(certificate: x509.Certificate) -> str:
    """The common name."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def identity_of(certificate: x509.Certificate) -> Identity | None:
    """Whose certificate it is; None if it is none of ours."""
    return identity(name_of(certificate))


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """The names and addresses a certificate holds for."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in names]


def read_issued(certificate_pem: bytes, key_pem: bytes) -> Issued:
    """A certificate and its key from their files; raises ValueError if they are damaged."""
    key = serialization.load_pem_private_key(key_pem, None)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError("its key is not an elliptic-curve key")
    return Issued(x509.load_pem_x509_certificate(certificate_pem), key)
