"""What the tab "Recording" says, as HTML or as labels. Pure."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from rhot.messages.recording import RecorderState, Recording, Recordings, Replay

_BOX = "font-size:0.85em;line-height:1.4;margin:0.3em 0.6em;overflow-wrap:anywhere;"
_RED = "#c0392b"
# What there is to choose where there is no recording.
NOTHING = "no recording yet"
# Label -> rate.
RATES: Mapping[str, float] = {
    "1/8": 0.125,
    "1/4": 0.25,
    "1/2": 0.5,
    "1": 1.0,
    "2": 2.0,
    "4": 4.0,
    "8": 8.0,
}


def status(state: RecorderState | None, now_ns: int, problem: str = "") -> str:
    """What the recorder does; state None: nobody answers."""
    if state is None:
        text = (
            "No recorder answers. <code>rhot up</code> starts one with the page; beside another"
            " rig start <code>rhot-recorder --config rig.toml --on-request</code>."
        )
    elif not state.records:
        text = "This page shows a recording."
    elif state.file:
        since = f", {length((now_ns - state.since_ns) * 1e-9)}" if state.since_ns else ""
        text = (
            f'<b style="color:{_RED}">&#9679; recording</b>{since}, {state.messages} messages,'
            f" {state.size_mb:.1f} MB<br>{html.escape(state.file)}"
        )
    else:
        text = "Nothing is being recorded."
    wrong = problem or (state.note if state is not None else "")
    if wrong:
        text += f'<br><span style="color:{_RED}">{html.escape(wrong[:400])}</span>'
    return f'<div style="{_BOX}">{text}</div>'


def labels(recordings: Recordings | None) -> dict[str, str]:
    """Label -> name of every recording that can be replayed, newest first."""
    whole = [r for r in (recordings.recordings if recordings else ()) if r.state == "whole"]
    return {_label(one): one.name for one in whole}


def _label(one: Recording) -> str:
    day = str(np.datetime64(one.start_ns // 10**9, "s")).replace("T", " ")
    return f"{day} UTC, {length(one.duration_s)} ({one.name})"


def notes(recordings: Recordings | None) -> str:
    """Where the recordings are, and which of them cannot be replayed."""
    if recordings is None:
        return ""
    lines = [f"in {html.escape(recordings.folder)}"] if recordings.folder else []
    lines += [
        f"{html.escape(one.name)} was cut off or is damaged: "
        f"<code>rhot replay --recover {html.escape(one.name)}</code>"
        for one in _damaged(recordings.recordings)[:5]
    ]
    if recordings.more:
        lines.append(f"{recordings.more} older ones are not listed")
    return f'<div style="{_BOX}opacity:0.75">{"<br>".join(lines)}</div>' if lines else ""


def _damaged(recordings: Sequence[Recording]) -> list[Recording]:
    restored = {one.name.removesuffix(".recovered.mcap") for one in recordings}
    return [
        one
        for one in recordings
        if one.state == "damaged" and one.name.removesuffix(".mcap") not in restored
    ]


def replay(one: Replay, rig: str, address: str) -> str:
    """What is being replayed, and where it is to be seen; rig is that of this page."""
    lines = [f"<b>{html.escape(one.name)}</b>"]
    if one.rig != rig:
        shown = html.escape(address, quote=True)
        lines.append(
            f'<a href="{shown}" target="_blank" style="color:#0072b2"><b>See it &#8599;</b></a>'
            " on a page of its own; this one stays live"
            if address
            else "its page is being opened ..."
        )
    if one.recorded_rig and one.recorded_rig not in (rig, one.rig.removesuffix("-replay")):
        lines.append(
            f"It is of rig {html.escape(one.recorded_rig)}: cameras and objects are drawn as this"
            f" rig's; <code>rhot replay {html.escape(one.name)} --view</code> shows its own"
        )
    lines.append({"playing": "playing", "paused": "paused", "ended": "at its end"}[one.state])
    return f'<div style="{_BOX}">{"<br>".join(lines)}</div>'


def rate_label(rate: float) -> str:
    """The choice that is nearest to a rate."""
    return min(RATES, key=lambda label: abs(RATES[label] - rate))


def length(seconds: float) -> str:
    """A duration for people."""
    seconds = max(0.0, seconds)
    if seconds < 100.0:
        return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s"
