"""A step is done once all its files are there, whoever wrote them; the worst error is told."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from rhot.files.config import RigConfig
from services.viewer.guide.files import CalibrationFolder, Done
from services.viewer.guide.steps import STEPS, Step


@pytest.fixture
def rig(config: RigConfig, tmp_path: Path) -> RigConfig:
    (tmp_path / "calibration").mkdir()
    return msgspec.structs.replace(config, folder=str(tmp_path))


def step_of(name: str) -> Step:
    return next(step for step in STEPS if step.name == name)


def write(rig: RigConfig, name: str, content: str) -> None:
    (rig.calibration_dir / name).write_text(content, encoding="utf-8")


def test_all_files_make_a_step_and_the_worst_error_counts(rig: RigConfig) -> None:
    folder, lens = CalibrationFolder(rig), step_of("lens")
    assert folder.done(lens) is None
    write(rig, "left.lens.json", '{"date": "2026-11-02", "residuals": {"held_out_px": 0.1}}')
    assert folder.done(lens) is None
    write(rig, "right.lens.json", '{"date": "2026-11-03", "residuals": {"held_out_px": 0.25}}')
    assert folder.done(lens) == Done("2026-11-02", "0.25 px")
    write(rig, "right.lens.json", '{"date": "2026-11-04", "residuals": {"held_out_px": "?"}}')
    assert folder.done(lens) == Done("2026-11-02", "0.10 px")
    (rig.calibration_dir / "left.lens.json").unlink()
    assert folder.done(lens) is None


def test_a_broken_file_is_no_calibration(rig: RigConfig) -> None:
    folder = CalibrationFolder(rig)
    write(rig, "rig.json", '{"date": ')
    assert folder.done(step_of("stereo")) is None


def test_a_hand_has_its_own_error(rig: RigConfig) -> None:
    write(rig, "hand.right.json", '{"residual_m": 0.0007, "date": "2026-11-05"}')
    assert CalibrationFolder(rig).done(step_of("hand")) == Done("2026-11-05", "0.7 mm")
