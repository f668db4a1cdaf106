"""Problems of the machines of a rig: hosts, the master's address, certificates, ports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rhot.files.config import RigConfig
from services.cli.check.problems import Problem, error, note, warning
from services.cli.rig.answers import Answers
from services.cli.rig.place import Place


def check_hosts(
    config: RigConfig, path: Path, place: Place, addresses_of: Callable[[str], Sequence[str]]
) -> list[Problem]:
    """Names that nobody knows, and a master's address that is another machine's."""
    problems = []
    for host in place.master_hosts:
        if not addresses_of(host):
            text = (
                f"[bus]: there is no host {host!r} as far as this machine knows; give the master's "
                "address, or a name that every machine of the rig knows"
            )
            problems.append(error(path, text))
    if not place.certain and any(addresses_of(host) for host in place.master_hosts):
        text = (
            f"[bus]: {' and '.join(place.master_hosts)} is not this machine. If this is the "
            "master, give its own address (`hostname -I`); if not, run `rhot check` and `rhot up` "
            "there"
        )
        problems.append(warning(path, text))
    for camera in config.camera if place.master else ():
        if camera.host and not addresses_of(camera.host):
            text = (
                f"camera {camera.name!r}: there is no host {camera.host!r} as far as this machine "
                "knows: is it switched on, is its name right? NAME.local needs libnss-mdns here"
            )
            problems.append(warning(path, text))
    host = config.objects.host
    if host and place.master and not addresses_of(host):
        text = f"[objects]: there is no host {host!r} as far as this machine knows: is it on?"
        problems.append(warning(path, text))
    return problems


def check_certificates(config: RigConfig, problem: str | None) -> list[Problem]:
    """What is wrong with this machine's certificate."""
    if problem is None:
        return []
    made = "" if "rhot pki" in problem else "; `rhot pki init` makes one for every machine"
    return [error(config.certificates_dir, f"{problem}{made}")]


def check_ports(
    config: RigConfig, path: Path, taken: Mapping[int, str], answers: Answers
) -> list[Problem]:
    """Ports that somebody else has; the rig's own router may have its.

    taken: ports of [bus] listen -> the process that listens there, "" if it cannot be seen.
    """
    if taken and answers.router:
        return [note(path, _running(config, answers))]
    return [
        error(
            path,
            f"[bus] listen: {owner or 'another program'} listens at port {port} already, and does "
            "not answer as a router: stop it, or give the router another port",
        )
        for port, owner in taken.items()
    ]


def check_router(config: RigConfig, path: Path, answers: Answers) -> list[Problem]:
    """On a Pi: whether the master's router answers."""
    if answers.router:
        return []
    text = (
        f"[bus] connect: no router answers at {', '.join(config.bus.connect)}: {answers.why_not}; "
        "is the master up (`rhot up`)?"
    )
    return [warning(path, text)]


def _running(config: RigConfig, answers: Answers) -> str:
    if answers.alive:
        names = ", ".join(sorted({service for service, _ in answers.alive}))
        return f"rig {config.rig.name!r} is running: {names}"
    return "a router runs here already: `rhot up` can start no second one at the same port"
