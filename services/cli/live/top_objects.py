"""The lines of `rhot top` that speak of objects. Pure."""

from __future__ import annotations

from rhot.watch.object_words import WORDS
from rhot.watch.rig_state import ObjectRow, RigState

# Of a screen of 24 lines, a sixth: faults and services need the rest.
_SHARE = 6
_MISSING = {"absent": "no pose has come", "silent": "no pose comes any more"}
# Of numbers from the network: huge ones would push the others out of the line.
_MOST = 99999.0


def object_lines(state: RigState, height: int | None) -> list[str]:
    """A line an object, those that are not tracked first where not all fit; None: all."""
    rows = state.objects
    room = len(rows) if height is None else max(height // _SHARE, 1)
    if len(rows) <= room:
        return [_line(row) for row in rows]
    urgent = sorted(rows, key=lambda row: row.state == "ok")
    shown = [_line(row) for row in urgent[: room - 1]]
    return [*shown, f"... {len(rows) - len(shown)} {'more ' if shown else ''}objects"]


def _line(row: ObjectRow) -> str:
    words = _MISSING.get(row.state) or WORDS[row.state]
    age = "" if row.state in _MISSING else f", {min(row.age_ms, _MOST):.0f} ms"
    sigma = "" if row.sigma_m is None else f", +-{min(1e3 * row.sigma_m, _MOST):.1f} mm"
    said = f"object {row.object}: {words}{age}{sigma if row.state == 'ok' else ''}"
    return said + "".join(f"; {one}" for one in _hands(row))


def _hands(row: ObjectRow) -> list[str]:
    held = [f"held by {hand}: {' '.join(parts)}" for hand, parts in row.held_by.items()]
    return held + [
        f"touched by {hand}: {' '.join(parts)}"
        for hand, parts in row.touching.items()
        if hand not in row.held_by
    ]
