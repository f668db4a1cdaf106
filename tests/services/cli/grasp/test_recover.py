"""`rhot grasp recover`: from files to files, and what it says where there is nothing to recover."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError, ConfigError
from services.cli.application import application
from studies.grasp.recording import save_recording
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person


def run(*words: object):
    return CliRunner().invoke(
        application(), ["grasp", "recover", *map(str, words)], catch_exceptions=True
    )


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "films"
    made.mkdir()
    for person in PEOPLE[:2]:
        recording = recorded_person(person, Motion(cycles=1, fps=20.0))
        save_recording(made / f"{person.name}.json", recording)
    (made / "scene.json").write_text('{"what": "a renderer knows"}')
    return made


def test_a_folder_gives_a_recovery_beside_each_recording(folder, tmp_path):
    done = run(folder, "--out", tmp_path / "out", "--method", "dls", "--frames", "20")
    assert done.exit_code == 0, done.output
    names = sorted(path.name for path in (tmp_path / "out").glob("*.json"))
    assert names == ["s1.json", "s1.recovered.json", "s2.json", "s2.recovered.json"]
    assert "2 of 2 recovered" in done.output
    assert "deg RMS" in done.output
    again = run(folder, "--out", tmp_path / "out")
    assert isinstance(again.exception, ConfigError)
    assert "is not an empty folder" in str(again.exception)


def test_one_bad_recording_does_not_keep_the_others(folder, tmp_path):
    broken = tmp_path / "broken.json"
    broken.write_text("{")
    done = run(folder, broken, "--out", tmp_path / "out", "--method", "dls")
    assert done.exit_code == 0, done.output
    assert (
        "broken.json: is no recording of a finger"
        in (tmp_path / "out" / "left_out.txt").read_text()
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{folder}", "--finger", "ring"], "no recording of finger ring; there are recordings of"),
        (["{empty}"], "nothing to recover in"),
        (["{empty}/none.json"], "cannot be read"),
        (["{empty}/none.csv"], "no such file or folder"),
        (["{folder}", "--method", "magic"], "there is no method 'magic'"),
        (["{folder}", "--limit", "knee:0:1"], "expected JOINT:LOW:HIGH"),
    ],
)
def test_what_cannot_be_recovered_says_why(folder, tmp_path, words, message):
    empty = tmp_path / "empty"
    empty.mkdir()
    words = [word.format(folder=folder, empty=empty) for word in words]
    done = run(*words, "--out", tmp_path / "out")
    assert isinstance(done.exception, CaptureError | ConfigError), done.output
    assert message in str(done.exception)
