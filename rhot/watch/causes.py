"""The faults of a rig as causes, each with what only follows from it. Pure.

Where nothing runs, or one camera is dark, a rig has a dozen faults and one reason. The order is
that of the way from router to pose (rhot/faults/way.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rhot.faults.objects import OBJECTS
from rhot.faults.way import FOLLOWING, MISSING, RESULTS, SLOW, breaks, place_on_way
from rhot.watch.onlooker_faults import about, fault_of
from rhot.watch.rig_state import StandingFault

_OBJECT_CODES = {kind.code for kind in OBJECTS}
_OBJECT_SERVICES = ("object_tracker", "openvr_bridge")
# What a stream's key says of objects and of cameras, in a text of a slow one.
_OBJECT_KEYS, _CAMERA_KEY = ("/object/", "/openvr/"), "/camera/"
_START_ALL = "start them: `rhot up rig.toml` starts all that belong on this computer"


@dataclass(frozen=True)
class Cause:
    """A fault that something is to be done about, and those that would go with it."""

    fault: StandingFault
    follows: tuple[StandingFault, ...] = ()


def causes(faults: Sequence[StandingFault]) -> list[Cause]:
    """Every fault once: those to act on first, in the order of the way, then by severity.

    Services that are not there count as one, whose parts follow from it.
    """
    missing = [one for one in faults if one.fault.code in MISSING]
    others = [one for one in faults if one.fault.code not in MISSING]
    found: dict[StandingFault, list[StandingFault]] = {}
    if missing:
        parts = missing if len(missing) > 1 else []
        found[_together(missing)] = list(parts)
    following = [one for one in others if _may_follow(one, missing)]
    first = [one for one in others if one not in following]
    for one in sorted(first, key=_order):
        found[one] = []
    # In the order of the way, so that what follows may itself be a cause of what is behind it.
    for one in sorted(following, key=_order):
        reason = next((cause for cause in found if _explains(cause, missing, one)), None)
        if reason is None:
            found[one] = []
        else:
            found[reason].append(one)
    ordered = sorted(found, key=_order)
    return [Cause(one, tuple(found[one])) for one in ordered]


def _order(one: StandingFault) -> tuple[bool, int, bool, int]:
    fault = one.fault
    # A slow camera, or a result, is the cause only where nothing else is broken.
    late = fault.code in (*SLOW, *RESULTS)
    return (not breaks(fault), place_on_way(fault.code), late, fault.since_ns)


def _may_follow(one: StandingFault, missing: Sequence[StandingFault]) -> bool:
    """Whether a fault may stand for nothing but another one's sake."""
    # A simulated camera has no pictures without the simulator, and no setting helps.
    unlit = any(part.fault.subject == "simulator" for part in missing)
    return one.fault.code in FOLLOWING or (unlit and one.fault.code == "camera_slow")


def _explains(
    cause: StandingFault, missing: Sequence[StandingFault], follower: StandingFault
) -> bool:
    """Whether a fault may stand because of another one."""
    code = cause.fault.code
    if not breaks(cause.fault) or place_on_way(code) >= place_on_way(follower.fault.code):
        return False
    parts = missing if code in MISSING else [cause]
    return any(_touches(part, follower) for part in parts)


def _touches(cause: StandingFault, follower: StandingFault) -> bool:
    """Whether two faults are of the same chain: of the hands or of the objects, of one camera."""
    if _of_objects(cause) != _of_objects(follower):
        return False
    ours, theirs = _camera(cause), _camera(follower)
    return not ours or not theirs or ours == theirs


def _of_objects(one: StandingFault) -> bool:
    # The object tracker hears the cameras, too: their paint on its trackers.
    if one.fault.code in SLOW and _CAMERA_KEY in one.fault.text:
        return False
    names = (one.teller, one.fault.subject)
    return (
        one.fault.code in _OBJECT_CODES
        or any(name.startswith(_OBJECT_SERVICES) for name in names)
        or (one.fault.code in SLOW and any(key in one.fault.text for key in _OBJECT_KEYS))
    )


def _camera(one: StandingFault) -> str:
    """The camera that a fault is of, "" if of none or of all."""
    for name in (one.teller, one.fault.subject):
        if name.startswith("pi_tracker/"):
            return name.partition("/")[2]
    return one.fault.subject if one.fault.code.startswith("camera_") else ""


def _together(missing: Sequence[StandingFault]) -> StandingFault:
    """All services that are not there as one fault; a single one as it is."""
    if len(missing) == 1:
        return missing[0]
    names = _names(one.fault.subject for one in missing)
    since_ns = min(one.fault.since_ns for one in missing)
    text = f"{len(missing)} programs of this rig do not run: {names}"
    return StandingFault(
        teller="", fault=fault_of("service_absent", text, "", since_ns, _START_ALL)
    )


def _names(subjects: Iterable[str]) -> str:
    words = []
    for subject in subjects:
        service, _, instance = subject.partition("/")
        words.append(about(service, instance or "main"))
    return f"{', '.join(words[:-1])} and {words[-1]}"
