"""Who somebody is on a secured bus: the common name of a certificate, `<rig>.<role>.<name>`.

`rhot pki` writes it, the router's access control (access_control.py beside this) knows it. Pure.
"""

from __future__ import annotations

import re
from typing import Literal, NamedTuple, get_args

from rhot.errors import BusError
from rhot.files.config import RigConfig

Role = Literal["camera", "master", "viewer", "objects", "router"]
ROLES: tuple[Role, ...] = get_args(Role)
# The one name in the master's role: a rig has one master.
MASTER = "master"

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*\Z")
_COMMON_NAME = re.compile(rf"(?P<rig>.+?)\.(?P<role>{'|'.join(ROLES)})\.(?P<name>.+)\Z")
# X.509's own bound on a common name.
_MAX_LENGTH = 64


class Identity(NamedTuple):
    """What a common name says."""

    rig: str
    role: Role
    name: str


def common_name(rig: str, role: Role, name: str) -> str:
    """The common name of a host's certificate; raises BusError where it would be ambiguous."""
    text = f"{rig}.{role}.{name}"
    if not (_NAME.match(rig) and _NAME.match(name)) or identity(text) != (rig, role, name):
        raise BusError(
            f"rig {rig!r} and host {name!r} cannot stand in a certificate's name; use letters, "
            f"digits, '_', '-' and '.', without one of .{'., .'.join(ROLES)}. in them"
        )
    if len(text) > _MAX_LENGTH:
        raise BusError(
            f"the certificate's name {text} is longer than {_MAX_LENGTH} characters; "
            "choose a shorter name for the rig or the host"
        )
    return text


def identity(text: str) -> Identity | None:
    """What a common name says, or None if it is not one of ours."""
    match = _COMMON_NAME.match(text)
    if match is None:
        return None
    role = next(role for role in ROLES if role == match["role"])
    return Identity(match["rig"], role, match["name"])


def certificate_names(config: RigConfig) -> dict[Role, list[str]]:
    """Names of the certificates that rig.toml calls for, beside the master's.

    A computer with several cameras has one certificate, named after the first of them.
    """
    return {
        "camera": list(cameras_by_certificate(config)),
        "viewer": list(config.bus.viewers),
        "objects": list(config.bus.object_sources),
    }


def cameras_by_certificate(config: RigConfig) -> dict[str, list[str]]:
    """Name of a certificate -> the cameras of its computer; a camera without a host is alone."""
    names: dict[str, str] = {}
    cameras: dict[str, list[str]] = {}
    for camera in config.camera:
        name = names.setdefault(camera.host, camera.name) if camera.host else camera.name
        cameras.setdefault(name, []).append(camera.name)
    return cameras
