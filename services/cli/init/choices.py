"""What a new rig is to be: the choices of `rhot init`, read from what people type. Pure.

What cannot be is a ConfigError that says what can.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from rhot.errors import ConfigError
from rhot.hand import BASIC_LANDMARKS, LANDMARKS, HandName

# The hues of the first hand's paints lie far apart and outside those of skin
# (services/simulator/scene/paints.py has the measurements); a second hand needs six more, which are
# closer to skin and to each other.
COLORS: tuple[tuple[str, ...], ...] = (
    ("violet", "magenta", "blue", "cyan", "green", "lime"),
    ("red", "orange", "yellow", "turquoise", "navy", "pink"),
)
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
_HOST = re.compile(r"[A-Za-z0-9][A-Za-z0-9.-]*\Z|\[?[0-9A-Fa-f:.]+\]?\Z")
_SOURCE = re.compile(r"(picamera2|simulator)\Z|(picamera2|v4l2|video|folder|capture):.+\Z")
_HANDS: dict[str, tuple[HandName, ...]] = {
    "right": ("right",),
    "left": ("left",),
    "both": ("right", "left"),
    "none": (),
}


@dataclass(frozen=True)
class CameraChoice:
    """One camera: its name, the host it hangs on ("": this machine), and its source."""

    name: str
    host: str
    source: str


@dataclass(frozen=True)
class Choices:
    """All that `rhot init` asks for; master is the master's address as other hosts see it."""

    name: str
    cameras: tuple[CameraChoice, ...]
    master: str = ""
    markers: dict[HandName, dict[str, str]] = field(default_factory=dict)
    fps: float = 30.0
    size_px: tuple[int, int] = (640, 480)
    objects: dict[str, str] = field(default_factory=dict)

    @property
    def hosts(self) -> list[str]:
        """Other computers with cameras, each once."""
        return list(dict.fromkeys(camera.host for camera in self.cameras if camera.host))


def camera_choice(text: str) -> CameraChoice:
    """NAME=HOST, NAME=SOURCE for a camera of this machine, or NAME=SOURCE@HOST."""
    name, equals, where = text.partition("=")
    source, at, host = where.rpartition("@")
    if not at:
        source, host = (where, "") if _SOURCE.match(where) else ("picamera2", where)
    if equals and _NAME.match(name) and _SOURCE.match(source) and (not host or _HOST.match(host)):
        return CameraChoice(name, host, source)
    raise ConfigError(
        f"{text!r} is no camera; write NAME=HOST (left=pi-left.local), NAME=SOURCE for a camera of "
        "this machine (left=v4l2:0), or NAME=SOURCE@HOST (left=v4l2:0@pi-left.local)"
    )


def host_choice(text: str) -> str:
    """A host's name or address."""
    if not _HOST.match(text):
        raise ConfigError(f"{text!r} is no host; give a name (master.local) or an address")
    return text


def name_choice(text: str) -> str:
    """The rig's name."""
    if not _NAME.match(text):
        raise ConfigError(
            f"{text!r} is no name; use letters, digits, '_', '-' and '.', starting with a letter "
            "or digit"
        )
    return text


def hands_choice(text: str) -> tuple[HandName, ...]:
    """right, left, both or none."""
    if text not in _HANDS:
        raise ConfigError(f"{text!r} is no hand; valid: {', '.join(_HANDS)}")
    return _HANDS[text]


def default_markers(hand_index: int) -> dict[str, str]:
    """Landmark -> colour of the first or the second hand."""
    return dict(zip(BASIC_LANDMARKS, COLORS[hand_index], strict=True))


def markers_choice(text: str) -> dict[str, str]:
    """LANDMARK=COLOUR, separated by commas or spaces."""
    found = _pairs(re.split(r"[,\s]+", text.strip()), "markers", "wrist=violet,index_tip=blue")
    for landmark in found:
        if landmark not in LANDMARKS:
            near = difflib.get_close_matches(landmark, LANDMARKS, n=1)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise ConfigError(f"unknown landmark {landmark!r}; {hint}Valid: {', '.join(LANDMARKS)}")
    return found


def objects_choice(texts: Iterable[str]) -> dict[str, str]:
    """NAME=SERIAL of each object's tracker."""
    return _pairs(texts, "object", "cup=LHR-12345678")


def size_choice(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT in px."""
    match = re.fullmatch(r"(\d{2,4})\s*[xX]\s*(\d{2,4})", text.strip())
    if not match:
        raise ConfigError(f"{text!r} is no size of a picture; write WIDTHxHEIGHT, e.g. 640x480")
    return int(match[1]), int(match[2])


def _pairs(texts: Iterable[str], what: str, example: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (equals and _NAME.match(name) and _NAME.match(value)):
            raise ConfigError(f"{text!r} is no {what}; write it like {example}")
        if name in found or value in found.values():
            raise ConfigError(f"{text!r}: {what} name and value must each be given once only")
        found[name] = value
    return found
