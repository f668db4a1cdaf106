"""The links as text: one line each, and what to do about the first that is broken. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from rhot.plain_text import printable
from services.cli.doctor.links import Link, first_cause

_STATES = {"ok": "ok", "worse": "worse", "broken": "BROKEN"}


def links_text(links: Sequence[Link]) -> str:
    """Every link, the first broken one marked with what to do."""
    width = max(len(link.name) for link in links)
    cause = first_cause(links)
    lines = []
    for link in links:
        code = f" [{link.code}]" if link.code else ""
        begin = f"{_STATES[link.state]:<7} {link.name:<{width}}"
        lines.append(f"{begin}  {printable(link.text)}{code}")
        if link is cause or link.state == "worse":
            lines.append(f"{'':<8}{'':<{width}}  -> {printable(link.action)}")
    lines.append(_verdict(links, cause))
    return "\n".join(lines)


def _verdict(links: Sequence[Link], cause: Link | None) -> str:
    if cause is None:
        worse = sum(link.state == "worse" for link in links)
        return "every link holds" + (f", {worse} should be mended" if worse else "")
    rest = sum(link.state == "broken" for link in links) - 1
    follow = f"; {rest} more below may only follow from it" if rest else ""
    return f"the first broken link: {cause.name}{follow}"
