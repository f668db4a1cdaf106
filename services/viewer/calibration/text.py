"""What the calibration page says, as HTML: what to do next, how well the colours can be told apart,
whether they are in force. Pure.

Texts from the network are escaped and shortened; numbers that are missing are left out.
"""

from __future__ import annotations

from typing import Any

from services.viewer.calibration.model import Session
from services.viewer.live.panels import text

_STYLE = "font-size:0.85em;line-height:1.4;padding:0 0.6em;"
_RED, _GREEN, _AMBER = "#c0392b", "#1e8449", "#b9770e"
_LEGEND = (
    '<div style="color:#666;font-size:0.9em">taken: share of the paint in its range; d\': how far apart, in standard deviations; '
    "4 and more is good</div>"
)
# Lines of warnings and notes: enough for six colours, short enough for a panel.
_MOST = 8


def to_do(session: Session, chosen: str, *, pictures: bool) -> str:
    """What the person should do now."""
    if not pictures:
        return _box(
            f"waiting for a picture of camera {text(session.camera)} ... (is its tracker running?)"
        )
    done = {one.color for one in session.pointed}
    lines = []
    if session.error:
        lines.append(_colored(session.error, _RED))
    clicks = sum(one.color == chosen for one in session.pointed)
    complete = done.issuperset(session.names)
    if complete and session.changed:
        lines.append(
            "All colours are pointed at: <b>put them in force</b>, or turn the hand and click again where a mask has holes."
        )
    elif complete:
        onward = (
            f"Now <b>camera {text(session.next_camera)}</b>."
            if session.next_camera
            else "Untick <i>show picture</i> to see the hand."
        )
        lines.append(f"This camera is done. {onward}")
    elif clicks:
        lines.append(
            f"<b>{text(chosen)}</b>: {clicks} click{'s' if clicks > 1 else ''}. Click again where its mask has holes, or move on."
        )
    else:
        lines.append(
            f"Hold the hand still and <b>click the middle of the {text(chosen)} marker</b> in the picture."
        )
    lines.append(
        f"{len(done & set(session.names))} of {len(session.names)} colours pointed at. Drag turns, the wheel zooms."
    )
    return _box("<br>".join(lines))


def report(session: Session) -> str:
    """Separation of the fitted colours, and warnings."""
    statistics = session.result.residuals
    rows = [_row(color, statistics) for color in session.names if color in session.result.colors]
    lines = [_colored(warning, _AMBER) for warning in session.result.warnings[:_MOST]]
    lines += [text(note, 200) for note in session.result.notes[:_MOST]]
    if session.edited:
        lines.append("set by hand: " + ", ".join(text(color) for color in sorted(session.edited)))
    if not rows and not lines:
        return _box(
            "nothing fitted yet; the masks show what is in force"
            if session.in_force.colors
            else "no colours are in force yet"
        )
    head = "<tr><td></td><td>taken</td><td>from skin</td><td>nearest</td></tr>" if rows else ""
    table = (
        f'<table style="width:100%;font-size:0.95em">{head}{"".join(rows)}</table>{_LEGEND}'
        if rows
        else ""
    )
    return _box(table + "<br>".join(lines))


def _row(color: str, statistics: dict[str, Any]) -> str:
    own = _table(_table(statistics, "colors"), color)
    near = _nearest(color, _table(statistics, "separation"))
    skin = _number(own.get("skin"), "d' {:.1f}")
    return f"<tr><td><b>{text(color)}</b></td><td>{_number(own.get('inside'), '{:.0%}')}</td><td>{skin}</td><td>{near}</td></tr>"


def _nearest(color: str, pairs: dict[str, Any]) -> str:
    found = []
    for names, pair in pairs.items():
        one, _, other = names.partition("/")
        apart = pair.get("d") if isinstance(pair, dict) else None
        if color in (one, other) and isinstance(apart, int | float) and apart >= 0.0:
            found.append((float(apart), other if one == color else one))
    return f"{text(min(found)[1])}, d' {min(min(found)[0], 999.0):.1f}" if found else ""


def _table(of: dict[str, Any], key: str) -> dict[str, Any]:
    """A table in statistics, which came over the network: empty if it is none."""
    value = of.get(key)
    return value if isinstance(value, dict) else {}


def _number(value: Any, form: str) -> str:
    return (
        form.format(min(float(value), 999.0))
        if isinstance(value, int | float) and value >= 0.0
        else ""
    )


def verdict(session: Session) -> str:
    """What is in force, and what is missing."""
    lines = []
    if session.saved:
        lines.append(
            _colored(
                f"in force on camera {session.camera}, and written on its machine, {_clock(session.saved)}",
                _GREEN,
            )
        )
    elif session.changed:
        lines.append("not in force yet: press the button")
    if session.missing:
        lines.append(f"still missing: {', '.join(text(name) for name in session.missing)}")
    return _box("<br>".join(lines) or "this is what is in force")


def _clock(date: str) -> str:
    """The time of day of an ISO date."""
    return date.partition("T")[2][:8]


def _colored(value: str, color: str) -> str:
    return f'<span style="color:{color}">{text(value, 300)}</span>'


def _box(content: str) -> str:
    return f'<div style="{_STYLE}">{content}</div>'
