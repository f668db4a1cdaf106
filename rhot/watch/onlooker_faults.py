"""Faults that nobody can tell of himself: a service that is not there, a router that is lost. Pure.

Who is absent, gone or silent is found by whoever looks at the whole rig; the words are the same for
all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from rhot.faults import fault_kind
from rhot.files.config import RigConfig
from rhot.messages.health import MAX_TEXT, Fault
from rhot.watch.rig_state import MISSING, ServiceRow

# What a service is to a person, where its name alone does not say it.
_ABOUT = {
    "pi_tracker": "the tracker of camera {instance}",
    "fusion": "fusion",
    "solver": "the solver",
    "object_tracker": "the object tracker",
    "openvr_bridge": "the bridge to SteamVR",
    "simulator": "the simulator",
    "viewer": "the viewer",
    "calibrator": "the calibrator",
    "recorder": "the recorder",
    "metrics": "the metrics for Prometheus",
}
_CODES = {"absent": "service_absent", "gone": "service_gone", "silent": "service_silent"}


def fault_of(code: str, text: str, subject: str, since_ns: int, action: str = "") -> Fault:
    """A fault of that code; its action is the list's own unless another is given."""
    kind = fault_kind(code)
    return Fault(
        code=code,
        severity=kind.severity,
        subject=subject[:100],
        text=text[:MAX_TEXT],
        action=(action or kind.action_for(subject))[:MAX_TEXT],
        since_ns=max(0, since_ns),
    )


def missing_services(config: RigConfig, rows: Iterable[ServiceRow], since_ns: int) -> list[Fault]:
    """A fault for every expected service that is absent, gone or silent.

    since_ns: since when the onlooker looks; a service that was never heard is absent since then.
    """
    words = {"absent": _absent, "gone": _gone, "silent": _silent}
    return [
        _fault(words[row.state], config, row, row.heard_ns or since_ns)
        for row in rows
        if row.expected and row.state in MISSING
    ]


def router_lost(endpoints: Iterable[str], since_ns: int) -> Fault:
    """The router has gone, and with it whatever else could be known."""
    where = ", ".join(endpoints)
    text = f"the router at {where} does not answer: of the services nothing can be known"
    return fault_of("router_unreachable", text, "router", since_ns)


def host_of(config: RigConfig, service: str, instance: str) -> str:
    """The computer that rig.toml has a service run on, in words."""
    cameras = {camera.name: camera.host for camera in config.camera}
    hosts = {"pi_tracker": cameras.get(instance, ""), "openvr_bridge": config.objects.host}
    host = hosts.get(service, "")
    return host or "the master"


def about(service: str, instance: str) -> str:
    """A service in words: `the tracker of camera left`."""
    return _ABOUT.get(service, f"{service}/{instance}").replace("{instance}", instance)


def _fault(
    words: Callable[[str, str, str], tuple[str, str]], config: RigConfig, row: ServiceRow, ns: int
) -> Fault:
    who = about(row.service, row.instance)
    text, action = words(who, host_of(config, row.service, row.instance), unit(row))
    return fault_of(_CODES[row.state], text, row.name, ns, action)


def unit(row: ServiceRow) -> str:
    """The name of a service's systemd unit; the solver's is fusion's, whose process solves."""
    service = "fusion" if row.service == "solver" else row.service
    name = f"rhot-{service.replace('_', '-')}"
    return f"{name}@{row.instance}" if row.service == "pi_tracker" else name


def _absent(who: str, host: str, unit: str) -> tuple[str, str]:
    return (
        f"{who} is not running, or hangs: nothing has been heard of it",
        f"start it on {host}: `systemctl start {unit}`, or `rhot up rig.toml` for all on one host",
    )


def _gone(who: str, host: str, unit: str) -> tuple[str, str]:
    return (
        f"{who} has ended, or {host} has lost the network",
        f"on {host}, `journalctl -u {unit} -n 20` tells why",
    )


def _silent(who: str, host: str, unit: str) -> tuple[str, str]:
    return (
        f"{who} is alive, but has not told its health for three seconds",
        f"{host} is overloaded, or the service hangs: `systemctl status {unit}` there",
    )
