"""A step that the calibrator measures: options, how far it is, its result; for one visitor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.messages.calibration import CalibrationOrder, CalibrationState, CalibrationStep
from services.viewer.guide import texts
from services.viewer.guide.callbacks import on_loop
from services.viewer.guide.link import CalibratorLink
from services.viewer.guide.steps import Step

_WORKING = ("collecting", "computing")


class CalibratorStep:
    """Controls of lens, stereo, hand and objects, of which one is shown."""

    def __init__(self, config: RigConfig, link: CalibratorLink, client: viser.ClientHandle) -> None:
        gui = client.gui
        self._config, self._link = config, link
        self._step: Step | None = None
        self._camera = gui.add_dropdown(
            "camera", tuple(camera.name for camera in config.camera) or ("none",)
        )
        self._hand = gui.add_dropdown("hand", tuple(config.hand) or ("right",))
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
        self._result = gui.add_html("")
        self._save = gui.add_button("Save", color="green")
        self._again = gui.add_button("Do it again")
        self._command = gui.add_html("")
        self._start.on_click(self._ordering("start"))
        self._again.on_click(self._ordering("start"))
        self._stop.on_click(self._ordering("stop"))
        self._save.on_click(self._ordering("save"))
        self.show(None)

    def show(self, step: Step | None) -> None:
        """Show a step's controls, or none."""
        self._step = step
        self.update()

    @property
    def working(self) -> bool:
        """Whether the step that is shown is measured now."""
        state, step = self._link.state, self._step
        if state is None or state.order is None or step is None:
            return False
        return state.order.step == step.name and state.phase in _WORKING

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
            _content(self._command, texts.by_command(step.command(self._config), why))
            return
        own = state.order is not None and state.order.step == step.name
        if own and state.phase in _WORKING:
            self._show_working(state)
        elif own and state.phase in ("done", "saved"):
            _content(self._result, texts.result(state))
            self._visible(self._result, self._save, self._again)
            self._save.disabled = state.phase == "saved"
        else:
            self._show_start(step, state, failed=own and state.phase == "failed")

    def _show_working(self, state: CalibrationState) -> None:
        progress: Any = self._progress  # its value is set from here, which its type forbids
        progress.value = round(100.0 * state.progress, 1)
        self._progress.animated = state.phase == "computing"
        _content(self._now, texts.collecting(state))
        self._visible(self._progress, self._now, self._stop)

    def _show_start(self, step: Step, state: CalibrationState, *, failed: bool) -> None:
        options: dict[str, list[Any]] = {
            "lens": [self._camera, self._square, self._count],
            "stereo": [self._square, self._count],
            "hand": [self._hand] if len(self._config.hand) > 1 else [],
        }
        shown = [self._start, self._command, *options.get(step.name, [])]
        busy = state.phase in _WORKING
        self._start.disabled = busy
        note = "Another step is being measured now." if busy else self._link.error
        if failed:
            _content(self._now, texts.collecting(state))
            shown.append(self._now)
        elif note:
            _content(self._now, texts.note(note))
            shown.append(self._now)
        _content(
            self._command,
            texts.by_command(step.command(self._config), "The same on the command line:"),
        )
        self._visible(*shown)

    def _visible(self, *shown: Any) -> None:
        every = (
            self._camera,
            self._hand,
            self._square,
            self._count,
            self._start,
            self._stop,
            self._progress,
            self._now,
            self._result,
            self._save,
            self._again,
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
        hand: HandName = "left" if self._hand.value == "left" else "right"
        self._link.send(
            CalibrationOrder(
                action=action,
                step=names[self._step.name],
                camera=str(self._camera.value),
                hand=hand,
                square_mm=min(max(float(self._square.value), 1.0), 1000.0),
                count=min(max(int(self._count.value), 5), 200),
            )
        )


def _content(handle: viser.GuiHtmlHandle, content: str) -> None:
    if handle.content != content:
        handle.content = content
