"""The texts of the live view's panel, as HTML. Pure.

Everything that came over the network is escaped and shortened: a browser executes what it is given.
What is missing is said in words, with what to check.
"""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np

from rhot.files.config import RigConfig
from rhot.hand import DIGIT_ANGLES, DIGITS, HandName
from rhot.messages import HandPose
from rhot.messages.health import Health, StreamHealth
from services.viewer.live.object_texts import object_lines
from services.viewer.live.palette import LEGEND
from services.viewer.live.views import View
from services.viewer.panel.words import sentence, service_words, stream_words, text

# Rows of the rates table: a rig of two Pis has some twenty streams.
_MAX_ROWS = 60
_STYLE = "font-size:0.8em;line-height:1.35;padding:0 0.6em;"
_CELL = "padding:0 0.5em 0 0;text-align:right;white-space:nowrap"
_MARKS = '<span style="opacity:0.7">circle: found; dashed circle: lost, where it was last; blue \
box: where it is looked for</span>'
_LEFT = "padding:0 0.5em 0 0;text-align:left"


def status(config: RigConfig, view: View, notes: Sequence[str], *, replayed: bool = False) -> str:
    """What is tracked, what is waited for, and standing notes such as missing calibration.

    Nothing is waited for of what is replayed: no program of this rig makes it.
    """
    if replayed and not (view.hands or view.points or view.objects):
        return _box("Nothing was recorded at this moment: play on, or move the time line.")
    lines = [_hand_line(config, hand, view) for hand in config.hand]
    if not config.hand:
        lines.append("no hand is configured: add [hand.right.markers] to rig.toml")
    lines += [text(line, 200) for line in object_lines(config, view)]
    lines += [sentence(note, 200) for note in notes]
    return _box("<br>".join(lines))


def _hand_line(config: RigConfig, hand: HandName, view: View) -> str:
    if hand in view.hands:
        if not view.hands[hand].seen:
            return f"{hand} hand: not seen now; shown where it is expected"
        latency = view.latency_ms.get(hand)
        after = "" if latency is None else f", {latency:.0f} ms after the light"
        return f"{hand} hand: tracked{after}"
    if any(of_hand == hand for of_hand, _ in view.points):
        return f"{hand} hand: its markers are seen; waiting for the solver to pose it ..."
    return f"{hand} hand: waiting for {_missing(config, view)} ..."


def _missing(config: RigConfig, view: View) -> str:
    """What is waited for: the first program on the way to a pose that is not heard, or prepares
    itself.
    """
    trackers = {health.instance for health in view.health if health.service == "pi_tracker"}
    silent = [camera.name for camera in config.camera if camera.name not in trackers]
    # One camera has no depth.
    if trackers and silent and len(config.camera) - len(silent) < 2:
        return f"camera {' and '.join(silent)}: its tracker is not heard"
    for needed, missing, unheard in (
        ("pi_tracker", "a camera's tracker", ": none is heard"),
        ("fusion", "fusion, which makes points of what cameras see", ""),
        ("solver", "the solver, which makes a hand of points", ""),
        ("simulator", "the simulator", None),
    ):
        states = {health.state for health in view.health if health.service == needed}
        if not states and unheard is not None:
            return missing + unheard
        if states == {"starting"}:
            return f"{missing}: it is starting"
    return "it: hold it into the view of two cameras"


def other_rigs(own: str, rigs: Sequence[tuple[str, str]]) -> str:
    """Which rig this page shows, and links to those of the others: name and address of each."""
    links = (
        f'<a href="{html.escape(address)}" style="text-decoration:underline">{text(rig)}</a>'
        for rig, address in rigs
    )
    return _box(f"rig <b>{text(own)}</b>; others: {', '.join(links)}")


def legend() -> str:
    """What the colours of joints, bones, touches and limits mean."""
    return _box(
        " &ensp; ".join(
            '<span style="display:inline-block">'
            f'<span style="color:rgb{entry.rgb}">&#9679;</span> {entry.words}</span>'
            for entry in LEGEND
        )
    )


def angles(pose: HandPose) -> str:
    """Joint angles in degrees, one row a finger; of the thumb its own joints from the wrist on."""
    # How far a tip is from its paint counts only of a finger that does not reach it.
    missed = any(finger.status != "solved" for finger in pose.fingers)
    rows = [_row(("", "spread", "base", "middle", "tip", "off by" if missed else ""), head=True)]
    for digit, names, finger in zip(DIGITS, DIGIT_ANGLES, pose.fingers, strict=True):
        degrees = [f"{_degrees(getattr(finger.angles_rad, name))}&deg;" for name in names]
        off = f"{min(finger.residual_m * 1e3, 999.0):.1f} mm" if finger.status != "solved" else ""
        mark = "" if finger.status == "solved" else f" ({text(finger.status.replace('_', ' '))})"
        rows.append(_row((digit + mark, *degrees, off)))
    return _table(rows)


def no_angles() -> str:
    """What stands in place of the angles while no hand is tracked."""
    return _box("nothing to show while no hand is tracked")


def rates(health: Sequence[Health]) -> str:
    """Every stream's rate against what is expected, and each service's last error."""
    if not health:
        return _box("waiting for the services' health ...")
    rows = [_row(("", "a second", "of", "ms old", "lost"), head=True)]
    for beat in health:
        name = text(service_words(beat.service, beat.instance))
        cpu = f"{min(beat.cpu_percent, 9999.0):.0f} % of a core"
        rows.append(f'<tr><td colspan="5"><b>{name}</b> {cpu}</td></tr>')
        rows += [_stream(stream) for stream in beat.streams]
        if beat.last_error:
            told = sentence(beat.last_error, 120)
            rows.append(f'<tr><td colspan="5" style="color:#c0392b">{told}</td></tr>')
    more = (
        f"<tr><td>... and {len(rows) - _MAX_ROWS} more</td></tr>" if len(rows) > _MAX_ROWS else ""
    )
    return _table([*rows[:_MAX_ROWS], more])


def _stream(stream: StreamHealth) -> str:
    arrow = "&rarr;" if stream.direction == "out" else "&larr;"
    rate = f"{min(stream.rate_hz, 99999.0):.1f}"
    shown = rate if stream.ok else f'<span style="color:#c0392b">{rate}</span>'
    expected = f"{min(stream.expected_hz, 99999.0):.0f}" if stream.expected_hz else ""
    latency = f"{min(stream.latency_p50_ms, 99999.0):.1f}" if stream.latency_p50_ms >= 0.0 else ""
    lost = stream.dropped + stream.rejected
    return _row(
        (
            f"{arrow} {text(stream_words(stream.key), 40)}",
            shown,
            expected,
            latency,
            str(min(lost, 10**9)) if lost else "",
        )
    )


def preview(camera: str, jpeg_base64: str | None, marks: str = "") -> str:
    """One camera's picture with marks over it (SVG, made here), or that it is waited for."""
    if jpeg_base64 is None:
        return _box(f"waiting for the picture of {text(camera)} ...")
    source = f"data:image/jpeg;base64,{jpeg_base64}"
    # Decoded before it is shown: no white between two pictures.
    picture = f'<img style="width:100%;display:block" decoding="sync" src="{source}" alt="">'
    return _box(
        f'{text(camera)}<div style="position:relative">{picture}{marks}</div>'
        + (_MARKS if marks else "")
    )


def _degrees(angle_rad: float) -> int:
    # Angles come over the network: anything beyond a full turn is shown as such. Whole numbers have
    # no "-0".
    return round(float(np.rad2deg(min(max(angle_rad, -7.0), 7.0))))


def _row(cells: Sequence[str], *, head: bool = False) -> str:
    tag = "th" if head else "td"
    return (
        "<tr>"
        + "".join(
            f'<{tag} style="{_CELL if i else _LEFT}">{cell}</{tag}>' for i, cell in enumerate(cells)
        )
        + "</tr>"
    )


def _table(rows: Sequence[str]) -> str:
    return _box(f'<table style="border-collapse:collapse;width:100%">{"".join(rows)}</table>')


def _box(content: str) -> str:
    return f'<div style="{_STYLE}">{content}</div>'
