"""Problems of the router's and the viewer's addresses."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from rhot.files.config import RigConfig
from services.cli.check.problems import Problem, error, warning
from services.cli.rig.place import host_and_port, is_local, network_hosts

# Zenoh's transports that bring their own protection, and those that never leave the machine.
_PROTECTED, _LOCAL = ("tls", "quic"), ("unixsock-stream", "unixpipe")
_OTHERS = ("tcp", "udp", "ws")
# Listening there is listening at all addresses of the machine.
_EVERYWHERE = ("0.0.0.0", "::")


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
    trackers = config.objects.host if config.objects.source == "steamvr" else ""
    remote = sorted({*(camera.host for camera in config.camera), trackers} - {""})
    if remote and all(map(_is_loopback, config.bus.listen)):
        text = (
            "[bus] listen: only this machine can reach the router, but the rig has other hosts: "
            f"{', '.join(remote)}"
        )
        problems.append(error(path, text))
    if remote and not network_hosts(config.bus.connect):
        text = (
            "[bus] connect: names no address of the master that other machines can reach, but "
            f"the rig has other hosts: {', '.join(remote)}; add e.g. tls/master.local:7448"
        )
        problems.append(error(path, text))
    ways = {_way(endpoint) for endpoint in config.bus.listen}
    if ways and config.bus.connect and ways.isdisjoint(map(_way, config.bus.connect)):
        text = (
            f"[bus] connect: the router of this rig listens nowhere that services look for it "
            f"({', '.join(config.bus.connect)}; listen: {', '.join(config.bus.listen)}), so that "
            "they would wait for ever; give both the same protocol and port, unless another router "
            "answers there"
        )
        problems.append(warning(path, text))
    return problems


def _way(endpoint: str) -> tuple[str, str]:
    """What a listener and those who connect to it have in common: protocol, and port or socket."""
    protocol, _, address = endpoint.partition("/")
    return protocol, address if protocol in _LOCAL else host_and_port(endpoint)[1]


def _is_endpoint(endpoint: str) -> bool:
    protocol, _, address = endpoint.partition("/")
    if protocol in _LOCAL:
        return bool(address)
    host, port = host_and_port(endpoint)
    known = protocol in (*_OTHERS, *_PROTECTED)
    return known and bool(host) and port.isdecimal() and 0 <= int(port) <= 65535


def _is_open(endpoint: str) -> bool:
    """Whether other machines may connect without protection."""
    protocol = endpoint.partition("/")[0]
    guarded = protocol in (*_PROTECTED, *_LOCAL) or _is_loopback(endpoint)
    return _is_endpoint(endpoint) and not guarded


def _is_loopback(endpoint: str) -> bool:
    host = host_and_port(endpoint)[0]
    return is_local(host) and host not in _EVERYWHERE


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
