"""`rhot calibrate lens` as a user types it."""

from __future__ import annotations

import pytest

from rhot.files.calibration import load_lens


def test_lens_writes_one_file(run_calibrate, board_pictures, tmp_path):
    _, pictures = board_pictures
    board = ("--board", "9x6", "--square", 0.025)
    result = run_calibrate("lens", "right", pictures, *board, "--out", tmp_path)
    assert "camera right, 400x300 px, 6 pictures" in result.stdout
    assert load_lens(tmp_path, "right").matrix[0][0] == pytest.approx(333.3, rel=5e-3)
    assert [path.name for path in tmp_path.iterdir()] == ["right.lens.json"]
