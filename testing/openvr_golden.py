"""The bridge's messages, from the binding's own structs: `python -m testing.openvr_golden --write`.

One for every ETrackingResult and every device class of the binding, for every event that is told,
and for poses at the edges. The bridge's tests compare them with the file; whoever reads the bus may
take it as what comes.
"""

from __future__ import annotations

import math
import re
import sys
from typing import Any

import msgspec
import openvr

from rhot.clock import Offset
from services.openvr_bridge.events import EVENTS
from services.openvr_bridge.step import BridgeStep
from services.openvr_bridge.sweep import Device, Event, Sweep
from testing.source_tree import ROOT
from testing.steamvr import NO_SLOT, TRACKER, Slot, records

PLACE = ROOT / "tests" / "services" / "openvr_bridge" / "golden" / "messages.json"
STAMP_NS = 1_700_000_000_000_000_000
_TURNED = ((0.0, -1.0, 0.0, 0.25), (1.0, 0.0, 0.0, 1.5), (0.0, 0.0, 1.0, -0.75))
_HALF_TURN = ((-1.0, 0.0, 0.0, 0.25), (0.0, 1.0, 0.0, 1.5), (0.0, 0.0, -1.0, -0.75))
_NAN = ((math.nan,) * 4, (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))


def golden() -> dict[str, Any]:
    """Name of each case -> its message, None where nothing is sent."""
    cases = {f"result {name}": _pose(result=value) for name, value in _enum("TrackingResult")}
    cases |= {
        f"class {name}": _pose(device_class=value) for name, value in _enum("TrackedDeviceClass")
    }
    cases |= {
        "pose half turn": _pose(matrix=_HALF_TURN),
        "pose not a number": _pose(matrix=_NAN),
        "pose not valid": _pose(valid=False),
        "pose of a device that is off": _pose(valid=False, connected=False, result=1),
        "pose of an unknown universe": _pose(universe_id=0),
    }
    cases |= {f"event {EVENTS[kind]}": _event(kind) for kind in sorted(EVENTS)}
    return cases


def _enum(prefix: str) -> list[tuple[str, int]]:
    """Names and values of an enum, which the binding keeps as plain constants."""
    found = [
        (name.removeprefix(f"{prefix}_"), int(getattr(openvr, name)))
        for name in dir(openvr)
        if re.fullmatch(rf"{prefix}_\w+", name) and not name.endswith("_Max")
    ]
    return sorted(found, key=lambda pair: pair[1])


def _device(device_class: int, universe_id: int = 7) -> Device:
    return Device(
        device_class, "LHR-1234ABCD", "VIVE Tracker 3.0", 0.75, False, universe_id, "lighthouse"
    )


def _pose(
    device_class: int = TRACKER, matrix: Any = _TURNED, universe_id: int = 7, **fields: Any
) -> Any:
    slot = Slot(
        device_class,
        matrix=matrix,
        velocity=(0.5, 0.0, -0.25),
        angular_velocity=(0.0, 2.0, 0.0),
        **fields,
    )
    devices = {3: _device(device_class, universe_id)} if device_class else {}
    sent = BridgeStep().poses(Sweep(STAMP_NS, records({3: slot}), devices), Offset(1_500_000, 40))
    return msgspec.to_builtins(sent[0]) if sent else None


def _event(kind: int) -> Any:
    # Events of a device name their slot, the others none.
    about = 3 if kind < 200 else NO_SLOT
    sweep = Sweep(STAMP_NS, records({}), {3: _device(TRACKER)}, (Event(kind, about, 0.25),))
    (message,) = BridgeStep().events(sweep, Offset(1_500_000, 40))
    return msgspec.to_builtins(message)


def text() -> str:
    """The file as it should be: one message a line."""
    lines = [
        f"{msgspec.json.encode(name).decode()}: {msgspec.json.encode(message).decode()}"
        for name, message in golden().items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    if sys.argv[1:] != ["--write"]:
        sys.exit("python -m testing.openvr_golden --write")
    PLACE.write_text(text(), encoding="utf-8")
    print(f"{PLACE}: {len(golden())} messages")
