"""Problems of the router's and the viewer's addresses."""

from __future__ import annotations

from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path

from rhot.files.config import RigConfig
from services.cli.check.problems import Problem, error, warning

# Zenoh's transports that bring their own protection, and those that never leave the machine.
_PROTECTED, _LOCAL = ("tls", "quic"), ("unixsock-stream", "unixpipe")
_OTHERS = ("tcp", "udp", "ws")


def check_bus(config: RigConfig, path: Path) -> list[Problem]:
    """Endpoints that are none, that are open to a network, or that no other host can reach."""
    problems = []
    for key, endpoints in (("connect", config.bus.connect), ("listen", config.bus.listen)):
        if not endpoints:
            problems.append(error(path, f'[bus] {key}: is empty; e.g. ["tcp/127.0.0.1:7447"]'))
        problems += [
            error(path, f"[bus] {key}: {endpoint!r} is no endpoint; e.g. tcp/127.0.0.1:7447")
            for endpoint in endpoints
            if not _is_endpoint(endpoint)
        ]
    for endpoint in config.bus.listen:
        if _is_open(endpoint) and config.bus.access == "open":
            text = (
                f"[bus] listen: {endpoint!r} is open to its network without protection: anybody "
                "there can read and publish; use a network of your own, or tls/ with certificates "
                "(docs/guide/security.md)"
            )
            problems.append(warning(path, text))
        elif _is_open(endpoint):
            text = (
                f"[bus] listen: {endpoint!r} has no certificates, so that nobody beyond this "
                "machine may do anything there; listen at tls/0.0.0.0:7448 (docs/guide/security.md)"
                ' or, in a network of your own, set [bus] access = "open"'
            )
            problems.append(error(path, text))
    remote = sorted({camera.host for camera in config.camera if camera.host})
    if remote and all(_is_loopback(endpoint.partition("/")[2]) for endpoint in config.bus.listen):
        text = (
            "[bus] listen: only this machine can reach the router, but there are cameras on "
            f"{', '.join(remote)}"
        )
        problems.append(error(path, text))
    return problems


def _is_endpoint(endpoint: str) -> bool:
    protocol, _, address = endpoint.partition("/")
    if protocol in _LOCAL:
        return bool(address)
    host, port = _host_and_port(address)
    known = protocol in (*_OTHERS, *_PROTECTED)
    return known and bool(host) and port.isdecimal() and 0 <= int(port) <= 65535


def _is_open(endpoint: str) -> bool:
    """Whether other machines may connect without protection."""
    protocol, _, address = endpoint.partition("/")
    guarded = protocol in (*_PROTECTED, *_LOCAL) or _is_loopback(address)
    return _is_endpoint(endpoint) and not guarded


def _is_loopback(address: str) -> bool:
    host = _host_and_port(address)[0].strip("[]")
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _host_and_port(address: str) -> tuple[str, str]:
    """Of HOST:PORT?METADATA#CONFIGURATION, as Zenoh writes addresses."""
    host, _, port = address.partition("#")[0].partition("?")[0].rpartition(":")
    return host, port


def check_viewer(config: RigConfig, path: Path) -> list[Problem]:
    """Ports that cannot be used, and a missing package."""
    problems = []
    port = config.viewer.port
    router_ports = {endpoint.rpartition(":")[2] for endpoint in config.bus.listen}
    if str(port) in router_ports:
        text = (
            f"[viewer] port: {port} is the router's port ([bus] listen); give it another, e.g. 8080"
        )
        problems.append(error(path, text))
    if 0 < port < 1024:
        text = f"[viewer] port: {port} needs root; give it one from 1024 on, or 0 for any free one"
        problems.append(warning(path, text))
    if find_spec("viser") is None:
        text = "[viewer]: viser is not installed; `pip install rhot[master]`"
        problems.append(warning(path, text))
    return problems
