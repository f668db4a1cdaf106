"""Problems of the bridge to SteamVR: the machine that it runs on, and its certificate."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from rhot.files.config import RigConfig
from services.cli.check.problems import Problem, error, warning
from services.cli.rig.place import Place

_GUIDE = "docs/guide/steamvr.md"
# Endpoints at which who comes shows a certificate.
_SECURED = ("tls/", "quic/")


def check_steamvr(config: RigConfig, path: Path, place: Place, registry: Path) -> list[Problem]:
    """Whether SteamVR can be read here, and whether its machine may send.

    registry is the file in which SteamVR would note where it is on this machine.
    """
    host = config.objects.host
    if config.objects.source != "steamvr":
        text = f"[objects] host = {host!r}: only SteamVR's bridge has a host; leave it out"
        return [warning(path, text)] if host else []
    if not config.object:
        return []
    problems = _certificate(config, path) if host else []
    return problems + (_this_machine(path, registry) if place.steamvr else [])


def _this_machine(path: Path, registry: Path) -> list[Problem]:
    problems = []
    where = '[objects] source = "steamvr"'
    if find_spec("openvr") is None:
        text = (
            f"{where} needs the package openvr here: `pip install 'rhot[openvr]'` (x86), or name "
            "the machine with SteamVR in [objects] host"
        )
        problems.append(warning(path, text))
    if not registry.is_file():
        text = (
            f"{where}: this user has never started SteamVR here (there is no {registry})"
            f": install and start it once ({_GUIDE}), or name its machine in [objects] host"
        )
        problems.append(warning(path, text))
    return problems


def _certificate(config: RigConfig, path: Path) -> list[Problem]:
    certified = config.bus.access == "certificates" and any(
        endpoint.startswith(_SECURED) for endpoint in config.bus.listen
    )
    if not certified or config.bus.object_sources:
        return []
    text = (
        f"[bus] object_sources: is empty, so that {config.objects.host!r} of [objects] may send "
        f'nothing: name its certificate, e.g. object_sources = ["steamvr"], and make it ({_GUIDE})'
    )
    return [error(path, text)]
