"""Which rigs a service is started with."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot.errors import ConfigError
from rhot.process.rigs.files import rig_files


def test_files_and_folders_in_order(tmp_path: Path) -> None:
    for name in ("b.toml", "a.toml", "notes.txt"):
        (tmp_path / name).touch()
    other = tmp_path / "else" / "rig.toml"
    assert rig_files([other, tmp_path]) == [other, tmp_path / "a.toml", tmp_path / "b.toml"]


def test_a_folder_without_rigs_and_a_file_given_twice_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no \*\.toml"):
        rig_files([tmp_path])
    (tmp_path / "a.toml").touch()
    with pytest.raises(ConfigError, match=r"given twice"):
        rig_files([tmp_path, tmp_path / "a.toml"])
