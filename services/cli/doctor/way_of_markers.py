"""The links from a camera's picture to a hand's pose. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rhot.faults.way import CLOCK, COLORS, MARKERS, PICTURE
from rhot.files.rig_tables import CameraTable
from rhot.hand import HandName
from rhot.messages.health import Fault
from rhot.watch.rig_state import RigState
from services.cli.doctor.links import Link, broken, holds, judged
from services.cli.doctor.observations import CameraSeen, HandSeen, Observations

CAMERA_CODES = {*PICTURE, *CLOCK, *COLORS, *MARKERS}
# As in rhot/bus/stats.py: one frame lost in five is where a user should look.
_SLOW = 0.8
# A colour in fewer than one of twenty pictures is not seen, whatever is found here and there.
_SEEN = 0.05
# A stream of a few messages in several seconds is none.
_MIN_MESSAGES = 3


def camera_links(seen: Observations, state: RigState, camera: CameraTable) -> list[Link]:
    """Picture, clock, colours and markers of one camera."""
    faults = _of_camera(state, camera.name)
    frames = seen.cameras.get(camera.name, CameraSeen())
    # An object's paint that is not in view is no broken link: objects lie where they lie.
    colors = seen.config.hand_colors if seen.config is not None else []
    name = camera.name

    def told(codes: Iterable[str]) -> list[Fault]:
        return [fault for fault in faults if fault.code in codes]

    ranges = holds(f"colors of {name}", "every colour has a range")
    return [
        judged(f"camera {name}", told(PICTURE), _frames(seen, camera, frames)),
        judged(f"clock of {name}", told(CLOCK), _clock(name, frames)),
        judged(ranges.name, told(COLORS), ranges),
        judged(f"markers of {name}", told(MARKERS), _markers(name, frames, colors)),
    ]


def _of_camera(state: RigState, camera: str) -> list[Fault]:
    """What its tracker says, and what others say of it."""
    return [
        one.fault
        for one in state.faults
        if one.teller == f"pi_tracker/{camera}"
        or one.fault.subject == camera
        or (one.fault.code == "marker_not_seen" and f" {camera} " in f" {one.fault.text} ")
    ]


def _frames(seen: Observations, camera: CameraTable, frames: CameraSeen) -> Link:
    name = f"camera {camera.name}"
    rate_hz = frames.frames / seen.listened_s if seen.listened_s > 0.0 else 0.0
    if not frames.frames:
        text = f"no markers of camera {camera.name!r} arrive, not even empty ones"
        return broken(name, "camera_silent", text, subject=camera.name)
    if rate_hz < _SLOW * camera.fps:
        text = f"{rate_hz:.1f} pictures a second of {camera.fps:g}"
        return broken(name, "camera_slow", text, subject=camera.name)
    return holds(name, f"{rate_hz:.1f} pictures a second of {camera.fps:g}")


def _clock(camera: str, frames: CameraSeen) -> Link:
    name = f"clock of {camera}"
    if frames.frames and not frames.clock_known:
        text = f"the clock of camera {camera!r} is not compared with the master's yet"
        return broken(name, "clock_unknown", text)
    return holds(name, "compared with the master's" if frames.frames else "nothing to judge by")


def _markers(camera: str, frames: CameraSeen, colors: Sequence[str]) -> Link:
    name = f"markers of {camera}"
    if not frames.frames or not colors:
        return holds(name, "nothing to judge by")
    least = max(1.0, _SEEN * frames.frames)
    missing = [color for color in colors if frames.colors.get(color, 0) < least]
    if not missing:
        return holds(name, f"all {len(colors)} colours are seen")
    if len(missing) == len(colors):
        text = f"camera {camera!r} sees no marker at all"
        action = "hold the hand into view of every camera, in the light it was calibrated in"
        return broken(name, "marker_not_seen", text, action)
    text = f"camera {camera!r} sees {len(colors) - len(missing)} of {len(colors)} colours"
    text += f", not {', '.join(missing)}"
    action = f"if they are in view and lit: `rhot calibrate colors {camera}`"
    return broken(name, "marker_not_seen", text, action)


def hand_links(seen: Observations, hand: HandName) -> list[Link]:
    """Points and poses of one hand."""
    found = seen.hands.get(hand, HandSeen())
    return [_points(seen, hand, found), _poses(hand, found)]


def _points(seen: Observations, hand: HandName, found: HandSeen) -> Link:
    name = f"points of {hand} hand"
    if found.points < _MIN_MESSAGES:
        return broken(name, "no_points", "fusion publishes no points at all")
    if found.measured < _SEEN * found.points:
        if _seen_by_two(seen, hand):
            text = "cameras see the same markers, and their views do not fit together"
            action = "is a camera mirrored, moved or at another size? `rhot check` knows the sizes"
            return broken(name, "no_points", text, action)
        return broken(name, "no_points", "no marker is seen by two cameras at once")
    return holds(name, f"{found.measured} of {found.points} messages with a measured point")


def _seen_by_two(seen: Observations, hand: HandName) -> bool:
    """Whether some colour of the hand is in many pictures of two cameras."""
    # Not an object's: its paint is seen while no hand is there.
    table = seen.config.hand.get(hand) if seen.config is not None else None
    own = set(table.markers.values()) if table is not None else set()
    often = [
        {color for color in own if camera.colors.get(color, 0) > 0.5 * camera.frames}
        for camera in seen.cameras.values()
    ]
    colors = [color for colors in often for color in colors]
    return len(colors) > len(set(colors))


def _poses(hand: HandName, found: HandSeen) -> Link:
    name = f"pose of {hand} hand"
    if found.poses < _MIN_MESSAGES:
        return broken(name, "no_pose", "the solver publishes no pose")
    if found.implausible:
        text = f"{found.implausible} of {found.poses} poses are nowhere near the cameras"
        return broken(name, "pose_implausible", text)
    return holds(name, f"{found.poses} poses")
