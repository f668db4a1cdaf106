"""What looks like a slip, as a user meets it."""

from __future__ import annotations

import os
import subprocess
import sys

import cv2
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import load_geometry

ASK = "from services.cli.calibrate.doubts import settle; settle(['odd'], yes=False); print('on')"


def test_a_square_ten_times_too_large_is_asked_about(run_calibrate, board_pictures, tmp_path):
    _, pictures = board_pictures
    command = ("stereo", pictures, "--board", "9x6", "--out", tmp_path, "--square", 0.25)
    with pytest.raises(CalibrationError, match=r"25 mm would be --square 0.025.*with --yes"):
        run_calibrate(*command)
    assert not list(tmp_path.iterdir())


def test_yes_takes_it_as_it_is(run_calibrate, board_pictures, tmp_path):
    _, pictures = board_pictures
    command = ("stereo", pictures, "--board", "9x6", "--out", tmp_path, "--square", 0.25, "--yes")
    result = run_calibrate(*command)
    assert "Taken as it is (--yes)" in result.stderr
    assert load_geometry(tmp_path).inputs["square_m"] == 0.25


@pytest.mark.parametrize(("answer", "code"), [("y", 0), ("n", 1)])
def test_a_person_at_a_terminal_is_asked(answer, code):
    master, terminal = os.openpty()
    asked = subprocess.Popen(
        [sys.executable, "-c", ASK], stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    os.write(master, f"{answer}\n".encode())
    out, err = asked.communicate(timeout=60)
    os.close(master)
    os.close(terminal)
    assert asked.returncode == code
    assert b"odd. Is it really so?" in err
    assert (b"on" in out) == (code == 0)


def test_a_lens_of_two_cameras_by_name_or_by_size_is_asked_about(
    run_calibrate, board_pictures, tmp_path
):
    _, pictures = board_pictures
    board = ("--board", "9x6", "--out", tmp_path / "out")
    with pytest.raises(CalibrationError, match=r"pictures of 2 cameras .* of 'left', 6 of 'right'"):
        run_calibrate("lens", "front", pictures, *board)
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for k, path in enumerate(sorted(pictures.glob("right*.png"))):
        image = cv2.imread(str(path))
        cv2.imwrite(str(mixed / path.name), cv2.resize(image, None, fx=1.0 + k % 2, fy=1.0 + k % 2))
    with pytest.raises(CalibrationError, match=r"of two sizes .3 are 400x300, 3 are 800x600"):
        run_calibrate("lens", "right", mixed, *board)
    assert not (tmp_path / "out").exists()
