"""A link of the way from router to pose, and how faults become its state. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import msgspec

from rhot.faults import FAULTS
from rhot.faults.way import RESULTS, SLOW, breaks
from rhot.messages.health import Fault

LinkState = Literal["ok", "worse", "broken"]


class Link(msgspec.Struct, frozen=True, kw_only=True):
    """One link: ok; worse: it holds, but something should be mended; or broken.

    code is that of rhot/faults/, "" where the link is ok.
    """

    name: str
    state: LinkState
    text: str
    action: str = ""
    code: str = ""


def holds(name: str, text: str) -> Link:
    """A link that is as it should be."""
    return Link(name=name, state="ok", text=text)


def broken(name: str, code: str, text: str, action: str = "", subject: str = "") -> Link:
    """A broken link; its action is that of the code unless another is given."""
    advice = action or FAULTS[code].action_for(subject)
    return Link(name=name, state="broken", text=text, action=advice, code=code)


def from_faults(name: str, faults: Iterable[Fault]) -> Link | None:
    """A link of what services say of it: the worst fault, with a count of the others."""
    found = sorted(faults, key=lambda f: (not breaks(f), f.code in SLOW, f.since_ns))
    if not found:
        return None
    worst = found[0]
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return Link(
        name=name,
        state="broken" if breaks(worst) else "worse",
        text=worst.text + more,
        action=worst.action,
        code=worst.code,
    )


def judged(name: str, faults: Iterable[Fault], observed: Link) -> Link:
    """What services say where it breaks the link, else what was observed where that does."""
    told = from_faults(name, faults)
    if told is None or (told.state != "broken" and observed.state == "broken"):
        return observed
    return told


def first_cause(links: Iterable[Link]) -> Link | None:
    """The first broken link: what comes after it may only follow from it.

    A slow camera is the cause only where nothing but its consequences is broken, too.
    """
    found = [link for link in links if link.state == "broken"]
    strong = (link for link in found if link.code not in (*SLOW, *RESULTS))
    return next(strong, found[0] if found else None)
