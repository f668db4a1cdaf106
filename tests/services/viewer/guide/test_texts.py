"""The calibration tab says what is done, what to do, and how good a result is; never HTML of
others.
"""

from __future__ import annotations

import msgspec

from rhot.files.config import RigConfig
from rhot.messages.calibration import CalibrationFigure, CalibrationOrder, CalibrationState
from rhot.messages.camera import ExposureControl
from rhot.messages.health import Fault
from rhot.watch.rig_state import StandingFault
from services.viewer.guide import texts
from services.viewer.guide.files import Done
from services.viewer.guide.steps import STEPS, steps_of


def test_a_rig_has_the_steps_that_it_needs(config: RigConfig) -> None:
    assert [step.name for step in steps_of(config)] == [step.name for step in STEPS]
    plain = msgspec.structs.replace(config, object=[], camera=config.camera[:1])
    assert [step.name for step in steps_of(plain)] == ["camera", "colours", "lens"]
    for step in STEPS:
        assert step.what.count(". ") >= 1, "two sentences"
        assert step.drawing.startswith("<svg")


def test_the_overview_counts_what_is_done_and_says_since_when(config: RigConfig) -> None:
    steps = steps_of(config)
    done = {"lens": Done("2026-11-02T10:00:00+01:00", "0.12 px"), "hand": None}
    said = texts.overview(steps, done, "lens")  # type: ignore[arg-type]
    assert "1 of 6 steps done" in said
    assert "0.12 px, 2026-11-02" in said
    assert "<b>Lens</b>" in said


def test_a_result_is_good_or_poor_with_figures_and_what_to_do() -> None:
    order = CalibrationOrder(action="start", step="lens", camera="left")
    state = CalibrationState(
        phase="done",
        order=order,
        good=False,
        figures=[CalibrationFigure(name="error", value="<i>9</i> px")],
        advice=["tilt the board"],
    )
    said = texts.result(state)
    assert "Poor" in said
    assert "Tilt the board" in said
    assert "&lt;i&gt;9" in said
    assert "<i>" not in said
    good = msgspec.structs.replace(state, good=True, advice=[])
    assert "Good" in texts.result(good)
    saved = msgspec.structs.replace(good, phase="saved", files=["left.lens.json"])
    assert "Saved: left.lens.json" in texts.result(saved)


def test_what_fails_and_what_to_do_is_said_harmlessly() -> None:
    failed = CalibrationState(phase="failed", to_do="no <b>board</b> was seen")
    assert "did not work" in texts.collecting(failed)
    assert "no &lt;b&gt;board" in texts.collecting(failed)
    now = CalibrationState(phase="collecting", to_do="hold still", seen=["3/15 positions"])
    assert "Hold still" in texts.collecting(now)
    assert "3/15 positions" in texts.collecting(now)
    started = CalibrationState(phase="collecting")
    assert "Getting ready ..." in texts.collecting(started)


def test_commands_are_set_apart() -> None:
    silent = texts.exposure("left", None, "no tracker answers; `rhot top` shows it", [])
    assert "<code>rhot top</code>" in silent


def test_an_exposure_is_judged_by_what_its_tracker_finds() -> None:
    fixed = ExposureControl(exposure_us=8000.0, gain=2.0)
    good = texts.exposure("left", fixed, "", [])
    assert "Good" in good
    assert "exposure 8.0 ms, gain 2.0; kept" in good
    dark = Fault(
        code="camera_dark", severity="error", text="it is black", action="light", since_ns=1
    )
    faults = [StandingFault(teller="pi_tracker/left", fault=dark)]
    assert "it is black; light" in texts.exposure("left", fixed, "", faults)
    assert "Good" in texts.exposure("right", fixed, "", faults)
    assert "nothing to set" in texts.exposure("left", ExposureControl(adjustable=False), "", [])


def test_a_simulated_rig_says_what_there_is_to_practise():
    for step in STEPS:
        assert "simulated" not in texts.instructions(step)
        assert step.practice
        assert step.practice in texts.instructions(step, simulated=True)
