"""Every condition that a rig knows to be wrong: a stable code, what it means, what to do.

One list for the journal, `rhot top`, `rhot doctor`, the page and Health: who finds a condition
gives its code and the particulars, and the words for everything else stand here. Pure.
docs/guide/troubleshooting.md has a section for each code.
"""

from __future__ import annotations

from rhot.errors import RhotError
from rhot.faults.cameras import CAMERA, FUSION
from rhot.faults.kind import FaultKind
from rhot.faults.objects import OBJECTS
from rhot.faults.services import RIG, SERVICE

__all__ = ["FAULTS", "FaultKind", "fault_kind"]

FAULTS: dict[str, FaultKind] = {
    kind.code: kind for kind in (*CAMERA, *FUSION, *OBJECTS, *SERVICE, *RIG)
}


def fault_kind(code: str) -> FaultKind:
    """The kind of that code; raises RhotError on one that is not in the list."""
    try:
        return FAULTS[code]
    except KeyError:
        raise RhotError(f"{code!r} is no fault code; valid: {', '.join(FAULTS)}") from None
