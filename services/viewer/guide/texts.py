"""The texts of the calibration tab, as HTML. Pure.

What came over the network is escaped and shortened: a browser executes what it is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rhot.messages.calibration import CalibrationState
from rhot.messages.camera import ExposureControl
from rhot.watch.rig_state import StandingFault
from services.viewer.guide.files import Done
from services.viewer.guide.steps import Step, StepName
from services.viewer.panel.words import sentence, text

_STYLE = "font-size:0.85em;line-height:1.4;padding:0 0.6em;overflow-wrap:anywhere"
_GREEN, _AMBER, _RED, _GREY = "#1e8449", "#b9770e", "#c0392b", "#7f8c8d"
_LONGEST = 600
_SIMULATED = "This rig is simulated, so that you can practise."
_BAR = "height:6px;border-radius:3px"
# Of a step that was started and has not said yet what to do: its libraries are being loaded.
GETTING_READY = "getting ready ..."


def overview(steps: Sequence[Step], done: Mapping[StepName, Done | None], shown: StepName) -> str:
    """All steps, what is done, and which one is shown."""
    rows = [
        _row(number, step, done.get(step.name), step.name == shown)
        for number, step in enumerate(steps, 1)
    ]
    finished = sum(1 for step in steps if done.get(step.name))
    share = 100 * finished // max(len(steps), 1)
    bar = (
        f'<div style="{_BAR};background:rgba(128,128,128,0.3);margin:0.4em 0">'
        f'<div style="{_BAR};width:{share}%;background:{_GREEN}"></div></div>'
    )
    head = f"<b>{finished} of {len(steps)} steps done</b>"
    return _box(f'{head}{bar}<table style="width:100%">{"".join(rows)}</table>')


def _row(number: int, step: Step, done: Done | None, shown: bool) -> str:
    mark = f'<span style="color:{_GREEN}">&#10003;</span>' if done else f"{number}"
    title = f"<b>{step.title}</b>" if shown else step.title
    about = ""
    if done:
        about = ", ".join(part for part in (done.error, _day(done.date)) if part) or "done"
    cell = f'<td style="text-align:right;color:{_GREY}">{text(about)}</td>'
    return f'<tr><td style="width:1.5em">{mark}</td><td>{title}</td>{cell}</tr>'


def _day(date: str) -> str:
    return date.partition("T")[0]


def instructions(step: Step, *, simulated: bool = False) -> str:
    """What a step is about, with its picture; of a simulated rig that it is for real ones."""
    note = (
        f'<br><span style="color:{_GREY}">{_SIMULATED} {step.practice}</span>' if simulated else ""
    )
    return _box(f"<b>{step.title}</b><br>{step.what}{note}{step.drawing}")


def collecting(state: CalibrationState) -> str:
    """What to do now, and what has been seen."""
    if state.phase == "failed":
        return _box(
            f'<span style="color:{_RED}"><b>This did not work.</b></span><br>{_said(state.to_do)}'
        )
    to_do = _said(_capital(state.to_do or GETTING_READY))
    now = f'<div style="font-size:1.25em;margin:0.2em 0"><b>{to_do}</b></div>'
    seen = "<br>".join(_said(line) for line in state.seen)
    return _box(now + seen)


def result(state: CalibrationState) -> str:
    """Whether it is good, the figures, and what to do."""
    if state.good:
        head = f'<span style="color:{_GREEN};font-size:1.15em"><b>&#10003; Good</b></span>'
    else:
        head = f'<span style="color:{_AMBER};font-size:1.15em"><b>Poor</b></span>'
    advice = "".join(f"<p>{_said(_capital(one))}</p>" for one in state.advice)
    if state.phase == "saved":
        names = ", ".join(text(name) for name in state.files)
        end = f'<span style="color:{_GREEN}">Saved: {names}. The rig uses it now.</span>'
    elif state.good:
        end = "Press <b>Save</b> to use it."
    elif saves_only_good(state):
        end = "It is not saved like this. Do it again."
    else:
        end = "Better do it again; <b>Save</b> uses it all the same."
    return _box(f"{head}{_table(state)}{advice}{end}")


def figures(state: CalibrationState) -> str:
    """What is known so far."""
    return _box(_table(state))


def saves_only_good(state: CalibrationState) -> bool:
    """Whether a poor result cannot be saved: of a hand in use, which can simply go on."""
    return state.order is not None and (state.order.step, state.order.way) == ("hand", "use")


def _table(state: CalibrationState) -> str:
    rows = "".join(
        f'<tr><td>{_said(one.name)}</td><td style="text-align:right;white-space:nowrap">'
        f"<b>{_said(one.value)}</b></td></tr>"
        for one in state.figures
    )
    return f'<table style="width:100%">{rows}</table>' if rows else ""


def by_command(command: str, why: str) -> str:
    """The same on the command line, to be copied."""
    code = (
        '<code style="user-select:all;display:block;padding:0.4em;margin:0.3em 0;'
        f'background:rgba(128,128,128,0.15);border-radius:4px">{text(command, 200)}</code>'
    )
    return _box(f'<span style="color:{_GREY}">{why}</span>{code}')


def note(said: str) -> str:
    """Why nothing can be started now."""
    return _box(f'<span style="color:{_AMBER}">{_said(_capital(said))}</span>')


def exposure(
    camera: str, state: ExposureControl | None, error: str, faults: Sequence[StandingFault]
) -> str:
    """What a camera's exposure is, and what is wrong with its pictures."""
    if error:
        return _box(f'<span style="color:{_RED}">{_said(error)}</span>')
    if state is None:
        return _box(f"waiting for camera {text(camera)} ...")
    own = [
        one.fault
        for one in faults
        if one.fault.code in _OF_PICTURES and one.teller.endswith(f"/{camera}")
    ]
    if own:
        head = f'<span style="color:{_AMBER}"><b>Poor</b></span>'
        lines = [f"{_said(one.text)}; {_said(one.action)}" for one in own]
    else:
        head = f'<span style="color:{_GREEN}"><b>&#10003; Good</b></span>: nothing is wrong'
        lines = []
    if not state.adjustable:
        lines.append("This camera has nothing to set.")
    elif state.exposure_us > 0.0:
        kept = "kept" if state.mode == "fixed" else "not kept yet: press the button"
        lines.append(
            f"exposure {min(state.exposure_us, 1e7) / 1e3:.1f} ms, gain "
            f"{min(state.gain, 999.0):.1f}; {kept}"
        )
    return _box("<br>".join([f"camera {text(camera)}: {head}", *lines]))


_OF_PICTURES = {"camera_dark", "camera_frozen", "camera_saturated", "camera_automatic"}


def _capital(value: str) -> str:
    return value[:1].upper() + value[1:]


def _said(value: str) -> str:
    return sentence(value, _LONGEST)


def _box(content: str) -> str:
    return f'<div style="{_STYLE}">{content}</div>'
