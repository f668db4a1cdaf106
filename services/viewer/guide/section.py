"""The tab "Calibration": every step of it, for one visitor.

Lens, places of the cameras, hand and objects are measured by the calibrator, one at a time for the
whole rig: all visitors see how far it is. The camera and its colours are between a visitor and the
camera's tracker.
"""

from __future__ import annotations

from typing import Any

import viser

from rhot.process.service import Service
from services.viewer.calibration.page import ColourStep
from services.viewer.guide import texts
from services.viewer.guide.calibrator_step import CalibratorStep
from services.viewer.guide.callbacks import on_loop
from services.viewer.guide.exposure_step import ExposureStep
from services.viewer.guide.files import CalibrationFolder
from services.viewer.guide.link import CalibratorLink
from services.viewer.guide.steps import OF_THE_CALIBRATOR, Step, steps_of
from services.viewer.visits.section import Seen

_BACK, _NEXT = "back", "next"


class GuideSection:
    """Guided calibration."""

    title = "Calibration"

    def __init__(self, service: Service) -> None:
        self.service, self.link = service, CalibratorLink(service)
        self.steps = steps_of(service.config)
        self.folder = CalibrationFolder(service.config)

    def open(self, client: viser.ClientHandle, tab: viser.GuiTabHandle) -> GuideTab:  # noqa: ARG002
        """Fill one visitor's tab."""
        return GuideTab(self, client)


class GuideTab:
    """One visitor's way through the steps."""

    def __init__(self, section: GuideSection, client: viser.ClientHandle) -> None:
        self._section = section
        gui, service = client.gui, section.service
        self._overview = gui.add_html("")
        self._choice = gui.add_dropdown("step", tuple(step.title for step in section.steps))
        self._way = gui.add_button_group("go", (_BACK, _NEXT))
        self._text = gui.add_html("")
        self._exposure = ExposureStep(service, client)
        self._colours = ColourStep(service, client)
        self._measured = CalibratorStep(service.config, section.link, client)
        self._folder = section.folder
        self._shown: Step | None = None
        # A page that opens while something is measured, or again after new files, shows that step.
        self._joined = False
        self._choice.on_update(on_loop(lambda _: self._show()))
        self._way.on_click(on_loop(self._went))
        section.link.watch()
        self._show()

    def update(self, seen: Seen) -> None:
        """Bring everything up to date."""
        self._join()
        step = self._step
        done = {one.name: self._folder.done(one) for one in self._section.steps}
        _set(self._overview, texts.overview(self._section.steps, done, step.name))
        if step.name == "camera":
            self._exposure.update(seen)
        elif step.name in OF_THE_CALIBRATOR:
            self._measured.update()
        # Who follows what to do now, or reads what came of it, needs no more than that; on a phone
        # there is no room for more.
        alone = step.name in OF_THE_CALIBRATOR and self._measured.alone
        for handle in (self._overview, self._text):
            if handle.visible == alone:
                handle.visible = not alone

    def close(self) -> None:
        """The visitor has gone; what the calibrator does goes on."""
        self._section.link.leave()
        self._exposure.close()
        self._colours.close()

    @property
    def _step(self) -> Step:
        title = str(self._choice.value)
        return next(step for step in self._section.steps if step.title == title)

    def _show(self) -> None:
        """Show the step that is chosen, and nothing of the others."""
        step = self._step
        if step is self._shown:
            return
        self._shown = step
        simulated = any(one.source == "simulator" for one in self._section.service.config.camera)
        _set(self._text, texts.instructions(step, simulated=simulated))
        self._exposure.show(step.name == "camera")
        self._colours.show(step.name == "colours")
        self._measured.show(_measurable(step))

    def _join(self) -> None:
        state = self._section.link.state
        if self._joined or state is None:
            return
        self._joined = True
        if state.order is not None and state.phase != "idle":
            self._choose(state.order.step)

    def _choose(self, name: str) -> None:
        choice: Any = self._choice  # its value is set from here, which its type forbids
        for step in self._section.steps:
            if step.name == name:
                choice.value = step.title
        self._show()

    def _went(self, event: Any) -> None:
        self._joined = True
        steps, to = self._section.steps, 1 if event.target.value == _NEXT else -1
        at = min(max(steps.index(self._step) + to, 0), len(steps) - 1)
        self._choose(steps[at].name)


def _measurable(step: Step) -> Step | None:
    return step if step.name in OF_THE_CALIBRATOR else None


def _set(handle: viser.GuiHtmlHandle, content: str) -> None:
    """Bring a text up to date; nothing is sent if it is."""
    if handle.content != content:
        handle.content = content
