"""The texts of the calibration page, as HTML: what to do next, how well the colours can be told
apart, whether they are applied. Pure.

Texts from the network are escaped and shortened; numbers that are missing are left out.
"""

from __future__ import annotations

from typing import Any

from services.viewer.calibration.model import ColorCalibration
from services.viewer.panel.words import text

_STYLE = "font-size:0.85em;line-height:1.4;padding:0 0.6em;"
_RED, _GREEN, _AMBER = "#c0392b", "#1e8449", "#b9770e"
_LEGEND = (
    '<div style="color:#666;font-size:0.9em">taken: share of the paint inside its range; '
    "d': distance from skin and from the nearest other colour in standard deviations; "
    "4 and more is good</div>"
)
# Lines of warnings and notes: enough for six colours, short enough for a panel.
_MOST = 8


def to_do(calibration: ColorCalibration, chosen: str, *, pictures: bool) -> str:
    """What the person should do now."""
    if not pictures:
        return _box(
            f"waiting for a picture of camera {text(calibration.camera)} ..."
            " (is its tracker running?)"
        )
    done = {click.color for click in calibration.clicks} & set(calibration.names)
    lines = []
    if calibration.error:
        lines.append(_colored(calibration.error, _RED))
    lines.append(_next_step(calibration, chosen, complete=len(done) == len(calibration.names)))
    lines.append(f"{len(done)} of {len(calibration.names)} colours clicked.")
    return _box("<br>".join(lines))


def _next_step(calibration: ColorCalibration, chosen: str, *, complete: bool) -> str:
    if complete and calibration.changed:
        return (
            "Every colour is clicked: press <b>apply</b>,"
            " or turn the hand and click again where a mask has holes."
        )
    if complete and calibration.next_camera:
        return f"This camera is done. Now <b>camera {text(calibration.next_camera)}</b>."
    if complete:
        return "This camera is done. Go on with the next step."
    clicks = sum(click.color == chosen for click in calibration.clicks)
    if clicks:
        return (
            f"<b>{text(chosen)}</b>: {clicks} click{'s' if clicks > 1 else ''}."
            " Click again where its mask has holes, or move on."
        )
    return (
        f"Hold the hand still and <b>click the middle of the {text(chosen)} marker</b>"
        " in the picture."
    )


def report(calibration: ColorCalibration) -> str:
    """Separation of the fitted colours, and warnings."""
    statistics = calibration.result.residuals
    rows = [
        _row(color, statistics) for color in calibration.names if color in calibration.result.colors
    ]
    lines = [_colored(warning, _AMBER) for warning in calibration.result.warnings[:_MOST]]
    lines += [text(note, 200) for note in calibration.result.notes[:_MOST]]
    if calibration.edited:
        lines.append(
            "set by hand: " + ", ".join(text(color) for color in sorted(calibration.edited))
        )
    if not rows and not lines:
        return _box(
            "nothing fitted yet; the masks show the applied ranges"
            if calibration.applied.colors
            else "no colours are applied yet"
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
    inside = _number(own.get("inside"), "{:.0%}")
    cells = (f"<b>{text(color)}</b>", inside, skin, near)
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


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


def status(calibration: ColorCalibration) -> str:
    """Whether what the page shows is applied, and what is missing."""
    lines = []
    if calibration.saved:
        saved = f"applied on camera {calibration.camera} and saved on its machine"
        lines.append(_colored(f"{saved}, {_time_of_day(calibration.saved)}", _GREEN))
    elif calibration.changed:
        lines.append("not applied yet: press <b>apply</b>")
    if calibration.missing:
        lines.append(f"still missing: {', '.join(text(name) for name in calibration.missing)}")
    return _box("<br>".join(lines) or "these are the applied ranges")


def _time_of_day(date: str) -> str:
    """The time of day of an ISO date."""
    return date.partition("T")[2][:8]


def _colored(value: str, color: str) -> str:
    return f'<span style="color:{color}">{text(value, 300)}</span>'


def _box(content: str) -> str:
    return f'<div style="{_STYLE}">{content}</div>'
