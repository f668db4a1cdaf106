"""`rhot board` as a user types it."""

from __future__ import annotations

import typer
from typer.testing import CliRunner

from services.cli.calibrate.board import board


def test_board_writes_a_pdf_and_says_how_to_use_it(tmp_path):
    app = typer.Typer()
    app.command()(board)
    path = tmp_path / "new" / "board.pdf"
    size = ["--cols", "7", "--rows", "5", "--square-mm", "30"]
    result = CliRunner().invoke(app, ["--kind", "charuco", *size, "--out", str(path)])
    assert path.read_bytes().startswith(b"%PDF")
    assert "--board 7x5 --square 0.03 --kind charuco" in result.stdout
