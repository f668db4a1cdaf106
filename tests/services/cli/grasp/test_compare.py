"""`rhot grasp compare`: what it prints, and what it says of recordings without a closing."""

from __future__ import annotations

import msgspec
import pytest
from typer.testing import CliRunner

from rhot.errors import CaptureError
from services.cli.application import application
from studies.grasp.recording import save_recording
from testing.synthetic_fingers import PEOPLE, Motion, recorded_person

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")


def run(*words: object):
    return CliRunner().invoke(application(), ["grasp", "compare", *map(str, words)])


def test_references_and_one_that_is_judged(tmp_path):
    folder = tmp_path / "healthy"
    folder.mkdir()
    for person in PEOPLE[:3]:
        recording = recorded_person(person, Motion(cycles=1, fps=20.0))
        save_recording(folder / f"{person.name}.json", recording)
    still = recorded_person(PEOPLE[4], Motion(cycles=1, fps=20.0))
    still = msgspec.structs.replace(still, frames=still.frames[:9])
    save_recording(folder / "still.json", still)
    other = tmp_path / "s4.json"
    save_recording(other, recorded_person(PEOPLE[3], Motion(cycles=1, fps=20.0)))
    done = run(folder, "--judge", other, "--out", tmp_path / "out", "--accuracy", "8")
    assert done.exit_code == 0, done.output
    assert "band of 3 references" in done.output
    assert "s4: " in done.output
    assert "left out: still: no closing found" in done.output
    assert (tmp_path / "out" / "compare.html").is_file()


def test_nothing_to_compare(tmp_path):
    still = recorded_person(PEOPLE[4], Motion(cycles=1, fps=20.0))
    save_recording(tmp_path / "still.json", msgspec.structs.replace(still, frames=still.frames[:9]))
    done = run(tmp_path / "still.json", "--out", tmp_path / "out")
    assert isinstance(done.exception, CaptureError)
    assert "a shape needs a closing" in str(done.exception)
