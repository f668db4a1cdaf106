"""Whether this machine's certificate lets it take its place in the rig."""

from __future__ import annotations

import time

from rhot.bus.security.credentials import Credentials, is_secured
from rhot.bus.security.roles import cameras_by_certificate, common_name
from rhot.bus.security.tls_diagnosis import own_problem, read_own_certificate
from rhot.files.config import RigConfig
from services.cli.rig.place import Place

MASTER = "master"


def certificate_problem(config: RigConfig, place: Place) -> str | None:
    """What is wrong with the files of [bus] certificates, or None; None also if none is needed."""
    needed = (*config.bus.connect, *(config.bus.listen if place.master else ()))
    if not any(map(is_secured, needed)):
        return None
    files = Credentials.of(config.certificates_dir)
    problem = own_problem(files, time.time())
    if problem is not None:
        return problem
    found = read_own_certificate(files).common_name
    wanted = wanted_names(config, place)
    if found in wanted or not wanted:
        return None
    return (
        f"this machine's certificate is {found}, and rig.toml calls for {' or '.join(wanted)} "
        "here: bring the right folder that `rhot pki` made"
    )


def wanted_names(config: RigConfig, place: Place) -> list[str]:
    """Common names of which this machine's certificate must have one."""
    if place.master:
        return [common_name(config.rig.name, "master", MASTER)]
    wanted = [
        common_name(config.rig.name, "camera", name)
        for name, cameras in cameras_by_certificate(config).items()
        if place.cameras & set(cameras)
    ]
    if place.steamvr:
        names = config.bus.object_sources
        wanted += [common_name(config.rig.name, "objects", name) for name in names]
    return wanted
