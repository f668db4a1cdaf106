"""`rhot calibrate` as a user types it, and the pictures of boards it is given."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from services.cli.calibrate.calibrate import calibrate
from testing.synthetic_boards import Bench, BenchSetup

Calibrate = Callable[..., Result]


@pytest.fixture
def run_calibrate() -> Calibrate:
    """Runs `rhot calibrate ...`; an error of ours is raised."""

    def run(*arguments: object) -> Result:
        texts = [str(argument) for argument in arguments]
        return CliRunner().invoke(calibrate, texts, catch_exceptions=False)

    return run


@pytest.fixture(scope="session")
def board_pictures(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bench, Path]:
    """Rendered pairs left01.png, right01.png, ... and one picture without a board.

    Do not write into the folder.
    """
    bench = BenchSetup(
        positions=6, size_px=(400, 300), focal_px=330.0, distortion=(-0.2, 0.05, 0.0, 0.0, 0.0)
    ).bench()
    folder = tmp_path_factory.mktemp("pictures")
    for camera in bench.cameras:
        for key in bench.poses:
            cv2.imwrite(str(folder / f"{camera.name}{key}.png"), bench.picture(camera, key))
    cv2.imwrite(str(folder / "left99.png"), np.full((300, 400), 90, dtype=np.uint8))
    return bench, folder


@pytest.fixture
def rig_toml(tmp_path: Path) -> Path:
    """A rig.toml of the cameras left and right."""
    path = tmp_path / "rig.toml"
    path.write_text('[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n')
    return path
