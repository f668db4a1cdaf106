"""What is wrong with the rig now, in plain words and with what to do. Pure.

What something is to be done about stands first; what only follows from it is told apart, for who
wants to know.
"""

from __future__ import annotations

from collections.abc import Sequence

from rhot.faults.way import FOLLOWING, SLOW
from rhot.watch.causes import Cause
from rhot.watch.rig_state import ServiceRow, StandingFault
from services.viewer.panel.words import sentence, service_words

# Causes that fit above the tabs of a small screen; the rest is in a folder.
_MAX_CAUSES = 3
_MAX_FOLLOWING = 30
# Preparing takes seconds, and 100 s of a processor's time once for each release of rhot, when numba
# compiles; who takes longer is not starting, but stuck.
_STARTING_S = 240.0
_RED, _AMBER, _BLUE = "#c0392b", "#b9770e", "#0072b2"
_WORDS = {"error": ("problem", _RED), "warning": ("note", _AMBER)}
_BOX = "font-size:0.85em;line-height:1.35;margin:0.3em 0.6em;padding:0.3em 0.5em;"


def starting(rows: Sequence[ServiceRow]) -> list[str]:
    """The programs that prepare themselves, in words: nothing comes of them yet."""
    return [
        service_words(row.service, row.instance)
        for row in rows
        if row.health is not None and row.state == "starting" and row.health.uptime_s < _STARTING_S
    ]


def of_no_start(faults: Sequence[StandingFault]) -> list[StandingFault]:
    """The faults that do not merely follow from programs that are starting."""
    return [one for one in faults if one.fault.code not in {*FOLLOWING, *SLOW}]


def wait(names: Sequence[str]) -> str:
    """That programs are starting, as HTML."""
    told = ", ".join(sentence(name, 80) for name in names[:_MAX_CAUSES])
    more = f" and {len(names) - _MAX_CAUSES} more" if len(names) > _MAX_CAUSES else ""
    return (
        f'<div style="{_BOX}border-left:4px solid {_BLUE}"><b style="color:{_BLUE}">starting:</b> '
        f"{told}{more}<br>The first start on a computer takes up to two minutes.</div>"
    )


def banner(causes: Sequence[Cause], now_ns: int) -> str:
    """The worst causes as HTML, those that are mended alike together; "" where there are none."""
    alike: dict[tuple[str, str], list[StandingFault]] = {}
    for cause in _first(causes):
        fault = cause.fault.fault
        alike.setdefault((fault.severity, fault.action), []).append(cause.fault)
    return "".join(_card(together, now_ns) for together in alike.values())


def following(causes: Sequence[Cause]) -> str:
    """The other causes, and what follows from any, one line each; "" where there is nothing."""
    first = _first(causes)
    rest = [cause.fault for cause in causes if cause not in first]
    lines = [_line(one) for one in (*rest, *(one for cause in causes for one in cause.follows))]
    if not lines:
        return ""
    more = len(lines) - _MAX_FOLLOWING
    shown = lines[:_MAX_FOLLOWING] + (
        [f"... and {more} more: <code>rhot top</code>"] if more > 0 else []
    )
    return f'<div style="{_BOX}">{"<br>".join(shown)}</div>'


def _first(causes: Sequence[Cause]) -> Sequence[Cause]:
    """Problems push notes aside: on a phone the tabs below would be out of sight."""
    problems = [cause for cause in causes if cause.fault.fault.severity == "error"]
    return (problems or causes)[:_MAX_CAUSES]


def headline(causes: Sequence[Cause]) -> str:
    """`2 problems`, for where there is room for nothing else; "" where all is well."""
    problems = sum(cause.fault.fault.severity == "error" for cause in causes)
    count, word = (problems, "problem") if problems else (len(causes), "note")
    return f"{count} {word}{'s' * (count > 1)}" if count else ""


def _card(alike: Sequence[StandingFault], now_ns: int) -> str:
    """Faults of one severity and with one thing to do."""
    fault = alike[0].fault
    word, color = _WORDS[fault.severity]
    told = "<br>".join(_told(one) + _since(one.fault.since_ns, now_ns) for one in alike)
    return (
        f'<div style="{_BOX}border-left:4px solid {color}">'
        f'<b style="color:{color}">{word}:</b> {told}<br>&rarr; {sentence(fault.action)}</div>'
    )


def _line(one: StandingFault) -> str:
    return f"&bull; {_told(one)} &rarr; {sentence(one.fault.action)}"


def _told(one: StandingFault) -> str:
    """The fault's text, and who says so."""
    service, _, instance = one.teller.partition("/")
    teller = sentence(service_words(service, instance or "main"), 80)
    return sentence(one.fault.text) + (f" (says {teller})" if one.teller else "")


def _since(since_ns: int, now_ns: int) -> str:
    """How long it lasts, in minutes; nothing where the sender's clock is no guide."""
    lasted_s = (now_ns - since_ns) * 1e-9
    if not 60.0 <= lasted_s < 1e7:
        return ""
    minutes = lasted_s / 60.0
    return f", for {minutes:.0f} min" if minutes < 120 else f", for {minutes / 60.0:.0f} hours"
