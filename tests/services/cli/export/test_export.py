"""The command `rhot export`: where tables go, and what it says of wrong ones."""

from __future__ import annotations

import shutil

import pytest

from rhot.errors import CaptureError, ConfigError
from services.cli.export.export import export


def test_tables_go_beside_the_result_and_are_named(result, tmp_path, capsys):
    folder = tmp_path / "result"
    shutil.copytree(result, folder)
    export(folder, only=["angles"], parquet=True)
    assert (folder / "angles.parquet").is_file()
    assert not (folder / "angles.csv").exists()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"{folder / 'angles.parquet'}: ")
    assert lines[0].endswith(" rows")


def test_an_unknown_table_is_told_with_those_there_are(result):
    with pytest.raises(ConfigError, match=r"--only bones: .* valid: markers, points, poses"):
        export(result, only=["bones"])


def test_a_file_in_the_folders_place_is_told(result, tmp_path):
    (tmp_path / "angles.csv").touch()
    with pytest.raises(ConfigError, match="is a file; give a folder"):
        export(result, out=tmp_path / "angles.csv")


def test_what_is_not_there_is_told(tmp_path):
    with pytest.raises(CaptureError, match=r"none: no such folder or file"):
        export(tmp_path / "none")


def test_a_folder_that_is_no_result_is_told(tmp_path):
    with pytest.raises(CaptureError, match=r"no complete result; make one with `rhot track"):
        export(tmp_path)


def test_a_file_that_is_no_recording_is_told(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"no recording")
    with pytest.raises(CaptureError, match="is no MCAP file"):
        export(tmp_path / "a.mcap")
