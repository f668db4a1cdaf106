"""A step that the calibrator measures: options, how far it is, its result; for one visitor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import viser

from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.messages.calibration import (
    CalibrationOrder,
    CalibrationState,
    CalibrationStep,
    HandWay,
)
from services.viewer.guide import texts
from services.viewer.guide.callbacks import on_loop
from services.viewer.guide.link import WORKING, CalibratorLink
from services.viewer.guide.steps import Step

# How a hand is measured, as a person calls it.
_WAYS: dict[str, HandWay] = {"follow the exercises": "exercises", "just use the hand": "use"}
_BUSY = "Another step is being measured now."
_LOST = "The calibrator was started again: what it had collected is lost. Press Start."


class CalibratorStep:
    """Controls of lens, stereo, hand and objects, of which one is shown."""

    def __init__(self, config: RigConfig, link: CalibratorLink, client: viser.ClientHandle) -> None:
        gui = client.gui
        self._config, self._link = config, link
        self._step: Step | None = None
        # Why this visitor was refused something, and the phase in which that was.
        self._refused: tuple[str, object] = ("", None)
        # This visitor pressed Start and was not answered yet; counted as the calibrator counts.
        self._starting: int | None = None
        self._camera = gui.add_dropdown(
            "camera", tuple(camera.name for camera in config.camera) or ("none",)
        )
        self._hand = gui.add_dropdown("hand", tuple(config.hand) or ("right",))
        self._way = gui.add_dropdown("how", tuple(_WAYS))
        self._square = gui.add_number(
            "square, mm",
            25.0,
            min=1.0,
            max=1000.0,
            step=0.1,
            hint="the side of one square of the board, as you measured it",
        )
        self._count = gui.add_number(
            "positions", 15, min=5, max=200, step=1, hint="how many times to hold the board still"
        )
        self._start = gui.add_button("Start", color="blue")
        self._stop = gui.add_button("Stop")
        self._progress = gui.add_progress_bar(0.0)
        self._now = gui.add_html("")
        self._note = gui.add_html("")
        self._result = gui.add_html("")
        self._save = gui.add_button("Save", color="green")
        # Where another camera, hand or way is chosen, too.
        self._again = gui.add_button("Back to the start")
        self._figures = gui.add_html("")
        self._command = gui.add_html("")
        self._start.on_click(self._ordering("start"))
        self._again.on_click(self._ordering("stop"))
        self._stop.on_click(self._ordering("stop"))
        self._save.on_click(self._ordering("save"))
        self._way.on_update(on_loop(lambda _: self.update()))
        self.show(None)

    def show(self, step: Step | None) -> None:
        """Show a step's controls, or none."""
        self._step = step
        self.update()

    @property
    def alone(self) -> bool:
        """Whether the step that is shown is measured now, or was: nothing else counts then."""
        state, step = self._link.state, self._step
        if state is None or state.order is None or step is None:
            return False
        return state.order.step == step.name and state.phase in (*WORKING, "done", "saved")

    def update(self) -> None:
        """Bring everything up to date with what the calibrator says."""
        step, state = self._step, self._link.state
        if step is None:
            self._visible()
            return
        if state is None:
            self._visible(self._command)
            why = (
                "The calibrator does not answer: is rhot-calibrator running? The same on the "
                "command line:"
            )
            _content(self._command, texts.by_command(self._by_command(step), why))
            return
        own = state.order is not None and state.order.step == step.name
        self._save.disabled = state.phase == "saved"
        color: Literal["green", "gray"] = "green" if state.good or state.phase == "done" else "gray"
        if self._save.color != color:
            self._save.color = color
        if self._starting != state.number:
            self._starting = None
        if own and state.phase in WORKING:
            self._show_working(state)
        elif own and state.phase in ("done", "saved"):
            _content(self._result, texts.result(state))
            self._save.disabled |= texts.saves_only_good(state) and not state.good
            self._visible(self._result, self._save, self._again, *self._refusal(state))
        else:
            self._show_start(step, state, failed=own and state.phase == "failed")

    def _show_working(self, state: CalibrationState) -> None:
        progress: Any = self._progress  # its value is set from here, which its type forbids
        progress.value = round(100.0 * state.progress, 1)
        self._progress.animated = state.phase == "computing"
        _content(self._now, texts.collecting(state))
        shown = [self._progress, self._now, self._stop, *self._refusal(state)]
        if state.figures:
            # It can be saved already, or is refused with the reason.
            _content(self._figures, texts.figures(state))
            shown += [self._figures, self._save]
        self._visible(*shown)

    def _refusal(self, state: CalibrationState) -> list[Any]:
        """Why this visitor was refused something, until the calibrator does something else."""
        why, of = self._refused
        if not why or of != (state.number, state.phase, state.good):
            return []
        _content(self._note, texts.note(why))
        return [self._note]

    def _show_start(self, step: Step, state: CalibrationState, *, failed: bool) -> None:
        options: dict[str, list[Any]] = {
            "lens": [self._camera, self._square, self._count],
            "stereo": [self._square, self._count],
            "hand": [self._way, *([self._hand] if len(self._config.hand) > 1 else [])],
        }
        shown = [self._start, self._command, *options.get(step.name, [])]
        busy, starting = state.phase in WORKING, self._starting is not None
        self._start.disabled = busy or starting
        refusal = self._refusal(state)
        if starting:
            _content(self._now, texts.note(texts.GETTING_READY))
            shown.append(self._now)
        elif failed:
            _content(self._now, texts.collecting(state))
            shown.append(self._now)
        elif busy or (self._link.lost and not refusal):
            _content(self._now, texts.note(_BUSY if busy else _LOST))
            shown.append(self._now)
        same = texts.by_command(self._by_command(step), "The same on the command line:")
        _content(self._command, same)
        self._visible(*shown, *refusal)

    def _by_command(self, step: Step) -> str:
        command = step.command(self._config)
        if step.name == "hand" and _WAYS[str(self._way.value)] == "use":
            command = command.replace(" --config", " --watch --config")
        return command

    def _visible(self, *shown: Any) -> None:
        every = (
            self._camera,
            self._hand,
            self._way,
            self._square,
            self._count,
            self._start,
            self._stop,
            self._progress,
            self._now,
            self._note,
            self._result,
            self._save,
            self._again,
            self._figures,
            self._command,
        )
        for handle in every:
            wanted = handle in shown
            if handle.visible != wanted:
                handle.visible = wanted

    def _ordering(self, action: Any) -> Callable[[Any], None]:
        return on_loop(lambda _: self._send(action))

    def _send(self, action: Any) -> None:
        if self._step is None:
            return
        names: dict[str, CalibrationStep] = {
            "lens": "lens",
            "stereo": "stereo",
            "hand": "hand",
            "objects": "objects",
        }
        self._starting = self._number if action == "start" else None
        hand: HandName = "left" if self._hand.value == "left" else "right"
        self._link.send(
            CalibrationOrder(
                action=action,
                step=names[self._step.name],
                camera=str(self._camera.value),
                hand=hand,
                way=_WAYS[str(self._way.value)],
                square_mm=min(max(float(self._square.value), 1.0), 1000.0),
                count=min(max(int(self._count.value), 5), 200),
            ),
            self._was_refused,
        )
        self.update()

    @property
    def _number(self) -> int | None:
        state = self._link.state
        return None if state is None else state.number

    def _was_refused(self, why: str) -> None:
        state, self._starting = self._link.state, None
        self._refused = (why, state and (state.number, state.phase, state.good))
        self.update()


def _content(handle: viser.GuiHtmlHandle, content: str) -> None:
    if handle.content != content:
        handle.content = content
