"""Which rigs a service is started with."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot.errors import ConfigError
from rhot.process.rigs.files import have_own_names, load_of, rig_files


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


def test_a_folder_may_have_a_folder_for_each_rig_and_be_empty_beside_others(tmp_path: Path) -> None:
    rig, rigs = tmp_path / "rig.toml", tmp_path / "rigs"
    rigs.mkdir()
    assert rig_files([rig, rigs]) == [rig]
    for name in ("lab", "attic"):
        (rigs / name).mkdir()
        (rigs / name / "rig.toml").touch()
    assert rig_files([rig, rigs]) == [rig, rigs / "attic" / "rig.toml", rigs / "lab" / "rig.toml"]
    # A capture beside files of rigs is none.
    (rigs / "desk.toml").touch()
    assert rig_files([rigs]) == [rigs / "desk.toml"]


def test_a_load_counts_frames_and_a_file_that_is_wrong_as_a_rig(tmp_path: Path) -> None:
    cameras = '[[camera]]\nname = "{}"\nfps = {}\n'
    for name, fps in (("usual", 30), ("fast", 90)):
        text = "".join(cameras.format(side, fps) for side in ("left", "right"))
        (tmp_path / f"{name}.toml").write_text(f'[rig]\nname = "{name}"\n{text}')
    (tmp_path / "wrong.toml").write_text("no toml")
    assert have_own_names(rig_files([tmp_path]))
    assert not have_own_names([tmp_path / "fast.toml"] * 2)
    assert load_of([tmp_path / "usual.toml"]) == 1.0
    assert load_of([*rig_files([tmp_path]), tmp_path / "gone.toml"]) == 1.0 + 3.0 + 1.0 + 1.0
