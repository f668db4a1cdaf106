"""The folder that `rhot demo` works in."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from rhot.errors import ConfigError
from rhot.files.config import load_rig
from services.cli.application import application
from services.cli.defaults import config_dir, sim_toml
from services.cli.live.working_copy import working_copy


def test_a_temporary_copy_has_all_of_the_rig_and_goes():
    with working_copy() as path:
        assert path.read_bytes() == sim_toml().read_bytes()
        names = sorted(file.name for file in (path.parent / "calibration").iterdir())
        assert names == sorted(file.name for file in (config_dir() / "calibration").iterdir())
        assert load_rig(path).rig.name == "sim"
    assert not path.parent.exists()


def test_a_folder_is_kept_and_used_again_as_it_is(tmp_path):
    with working_copy(tmp_path / "a" / "b") as path:
        (path.parent / "calibration" / "left.colors.json").write_text("mine")
    with working_copy(tmp_path / "a" / "b") as again:
        assert again == path
        assert (path.parent / "calibration" / "left.colors.json").read_text() == "mine"


def test_a_scene_of_its_own_is_for_a_new_copy_only(tmp_path):
    shipped = sim_toml().read_text(encoding="utf-8").splitlines()
    with working_copy(tmp_path / "a", "wave") as path:
        assert load_rig(path).simulator.scene == "wave"
        changed = path.read_text(encoding="utf-8").splitlines()
        assert [(a, b) for a, b in zip(shipped, changed, strict=True) if a != b] == [
            (f'scene = "{load_rig(sim_toml()).simulator.scene}"', 'scene = "wave"')
        ]
    with (
        pytest.raises(ConfigError, match="set `scene` under"),
        working_copy(tmp_path / "a", "fist"),
    ):
        pass
    with working_copy(tmp_path / "a") as path:
        assert load_rig(path).simulator.scene == "wave"


def test_foreign_files_are_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with (
        pytest.raises(ConfigError, match=r"no rig\.toml \(thesis\.tex\).*empty folder"),
        working_copy(tmp_path),
    ):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"), working_copy(tmp_path / "file"):
        pass


def test_another_rig_runs_where_it_is_and_has_no_copy():
    ran = CliRunner().invoke(application(), ["demo", "--config", "rig.toml", "--folder", "copy"])
    assert isinstance(ran.exception, ConfigError)
    assert "give one of them" in str(ran.exception)


def test_a_scene_is_checked_before_anything_starts():
    ran = CliRunner().invoke(application(), ["demo", "--scene", "grap"])
    assert isinstance(ran.exception, ConfigError)
    assert "did you mean 'grab'" in str(ran.exception)
    ran = CliRunner().invoke(application(), ["demo", "--scene", "grab", "--config", "rig.toml"])
    assert "under [simulator] in rig.toml" in str(ran.exception)
