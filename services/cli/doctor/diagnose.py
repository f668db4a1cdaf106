"""Observations -> links, from rig.toml over the router to the pose. Pure.

What services tell of themselves comes before what was only observed from outside: a camera that is
dark also gives no markers, and only the first of these is the cause.
"""

from __future__ import annotations

from rhot.faults import FAULTS
from rhot.faults.way import MISSING as MISSING_CODES
from rhot.faults.way import ONE_OF_EACH, SESSION, VIEWS
from rhot.files.config import RigConfig
from rhot.messages.health import Fault
from rhot.watch.onlooker_faults import about, host_of
from rhot.watch.rig_state import MISSING, RigState, ServiceRow, StandingFault
from services.cli.doctor.links import Link, broken, from_faults, holds
from services.cli.doctor.observations import Observations
from services.cli.doctor.way_of_markers import CAMERA_CODES, camera_links, hand_links
from services.cli.doctor.way_of_objects import OBJECT_CODES, object_links

_BRIDGE = "openvr_bridge"
# Judged by links of their own, before the cameras.
_JUDGED = (*ONE_OF_EACH, *SESSION, *MISSING_CODES)
_KNOWN = {*CAMERA_CODES, *VIEWS, *OBJECT_CODES, *_JUDGED}


def diagnose(seen: Observations) -> list[Link]:
    """Every link that could be judged, in order; after the file, the router: nothing without it."""
    links = [_file(seen)]
    if seen.config is None:
        return links
    if seen.secured:
        links.append(_certificates(seen))
    links.append(_router(seen))
    if seen.state is None:
        return links
    config, state = seen.config, seen.state
    faults = [one.fault for one in state.faults]
    links += [_service(config, row, seen) for row in state.services if row.expected]
    links += [_one_of_each(seen, faults), _clock_master(seen, faults), _session(seen)]
    for camera in config.camera:
        links += camera_links(seen, state, camera)
    links += _views(faults)
    for hand in config.hand if config.has_depth else ():
        links += hand_links(seen, hand)
    links += _steamvr(state)
    links += object_links(seen, [f for f in faults if f.code in OBJECT_CODES])
    return links + _remaining(state)


def _file(seen: Observations) -> Link:
    if seen.config is None:
        return broken("rig.toml", "config_broken", seen.config_problem)
    cameras = " and ".join(camera.name for camera in seen.config.camera) or "no camera"
    return holds("rig.toml", f"{seen.config_path}: rig {seen.config.rig.name!r}, {cameras}")


def _certificates(seen: Observations) -> Link:
    if seen.certificate_problem and not seen.connected:
        return broken("certificates", "certificate_refused", seen.certificate_problem)
    return holds("certificates", "this host's certificate and the router's fit together")


def _router(seen: Observations) -> Link:
    routers = {one.router: one.endpoint for one in seen.reached if one.router}
    if len(routers) > 1:
        text = f"different routers answer at {' and at '.join(routers.values())}"
        action = "stop one: services of the one do not meet those of the other"
        return broken("router", "second_service", text, action)
    if seen.connected:
        at = [one.endpoint for one in seen.reached if not one.problem]
        return holds("router", f"answers at {at[0]}" if at else "answers")
    text = "; ".join(f"{one.endpoint}: {one.problem}" for one in seen.reached)
    if seen.routers_here:
        here = ", ".join(seen.routers_here)
        text += f". A router of this computer listens at {here}"
        action = FAULTS["router_unreachable"].action + (
            f'; or, if that one is this rig\'s, `connect = ["{seen.routers_here[0]}"]` under [bus] '
            "in rig.toml"
        )
        return broken("router", "router_unreachable", text, action)
    return broken("router", "router_unreachable", text or "no endpoint in [bus] connect")


def _service(config: RigConfig, row: ServiceRow, seen: Observations) -> Link:
    who = about(row.service, row.instance)
    if row.state == "starting":
        text = f"{who} is still starting"
        action = "wait; the first start compiles for a minute, which `rhot warm` does ahead"
        return broken(row.name, "service_absent", text, action)
    if row.state not in MISSING:
        version = f", version {row.health.version}" if row.health else ""
        return holds(row.name, f"{row.state} on {_where(config, row)}{version}")
    if row.service in ("fusion", "solver") and row.state != "silent" and seen.calibration_problem:
        text = f"{who} cannot start: {seen.calibration_problem}"
        return broken(row.name, "not_calibrated", text)
    found = [
        one.fault
        for one in (seen.state.faults if seen.state else [])
        if one.fault.subject == row.name and one.fault.code.startswith("service_")
    ]
    return from_faults(row.name, found) or broken(row.name, "service_absent", f"{who}: {row.state}")


def _where(config: RigConfig, row: ServiceRow) -> str:
    told = row.health.host if row.health is not None else ""
    return told or host_of(config, row.service, row.instance)


def _one_of_each(seen: Observations, faults: list[Fault]) -> Link:
    if seen.doubles:
        # Services that share a process come twice together.
        places = next(iter(seen.doubles.values()))
        names = sorted(name for name, at in seen.doubles.items() if at == places)
        run = "runs" if len(names) == 1 else "run"
        text = f"{' and '.join(names)} {run} {len(places)} times: {' and '.join(places)}"
        return broken("one of each", "second_service", text)
    found = from_faults("one of each", [f for f in faults if f.code == "second_service"])
    return found or holds("one of each", "no service runs twice")


def _clock_master(seen: Observations, faults: list[Fault]) -> Link:
    masters = seen.clock_masters
    if len(masters) > 1:
        text = f"{len(masters)} answer for the master's clock: {' and '.join(masters)}"
        return broken("master clock", "second_clock", text)
    if not masters:
        return broken("master clock", "clock_unknown", "nobody answers for the master's clock")
    found = from_faults("master clock", [f for f in faults if f.code == "second_clock"])
    return found or holds("master clock", "one answers")


def _session(seen: Observations) -> Link:
    if seen.session_running is None:
        text = "nobody answers for the session, which fusion keeps"
        action = "see whether fusion runs: `systemctl status rhot-fusion` on the master"
        return broken("session", "session_stopped", text, action)
    if not seen.session_running:
        text = "the session is stopped: no camera sends markers"
        return broken("session", "session_stopped", text)
    return holds("session", "running")


def _views(faults: list[Fault]) -> list[Link]:
    found = from_faults("cameras together", [f for f in faults if f.code in VIEWS])
    return [found or holds("cameras together", "their views fit the calibration")]


def _steamvr(state: RigState) -> list[Link]:
    """Why no tracker of SteamVR has a pose, where its bridge knows."""
    lost = (one.fault for one in state.faults if one.teller.startswith(_BRIDGE))
    link = from_faults("SteamVR", [fault for fault in lost if fault.code == "source_lost"])
    return [link] if link else []


def _remaining(state: RigState) -> list[Link]:
    """What no link above judges: disks, heat, whatever else services complain of."""
    links = []
    for teller in dict.fromkeys(one.teller for one in state.faults):
        own = [f.fault for f in state.faults if f.teller == teller and not _is_judged(f)]
        if own and (link := from_faults(teller or "rig", own)):
            links.append(link)
    return links


def _is_judged(one: StandingFault) -> bool:
    """Whether a link above speaks of it; a lost source may be a camera's or another service's."""
    has_link = one.teller.startswith(("pi_tracker/", _BRIDGE)) or one.fault.code != "source_lost"
    return one.fault.code in _KNOWN and has_link
