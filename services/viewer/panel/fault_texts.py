"""What is wrong with the rig now, at the top of the page, and what to do. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from rhot.watch.rig_state import StandingFault
from services.viewer.panel.texts import text

# More than fit above the switches of a small screen; the rest is counted.
_MAX_FAULTS = 8
_COLORS = {"error": "#c0392b", "warning": "#b9770e"}
_BOX = "font-size:0.85em;line-height:1.35;margin:0.3em 0.6em;padding:0.3em 0.5em;"
_LONGEST = 300


def faults(standing: Sequence[StandingFault], now_ns: int) -> str:
    """The faults as HTML, errors first as they come; "" where there are none."""
    shown = [_fault(one, now_ns) for one in standing[:_MAX_FAULTS]]
    if len(standing) > _MAX_FAULTS:
        more = len(standing) - _MAX_FAULTS
        shown.append(f'<div style="{_BOX}">... and {more} more: `rhot top` lists all</div>')
    return "".join(shown)


def _fault(one: StandingFault, now_ns: int) -> str:
    fault = one.fault
    color = _COLORS[fault.severity]
    teller = f"{text(one.teller)}: " if one.teller else ""
    return (
        f'<div style="{_BOX}border-left:4px solid {color}">'
        f'<b style="color:{color}">{fault.severity}</b> {teller}{text(fault.text, _LONGEST)}'
        f"{_since(fault.since_ns, now_ns)}<br>&rarr; {text(fault.action, _LONGEST)}"
        f' <span style="opacity:0.6">[{text(fault.code)}]</span></div>'
    )


def _since(since_ns: int, now_ns: int) -> str:
    """How long it lasts; nothing where the sender's clock is no guide."""
    lasted_s = (now_ns - since_ns) * 1e-9
    if not 1.0 <= lasted_s < 1e7:
        return ""
    words = f"{lasted_s:.0f} s" if lasted_s < 120 else f"{lasted_s / 60:.0f} min"
    return f", for {words}"
