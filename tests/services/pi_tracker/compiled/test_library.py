"""The compiled form is used where it fits, and nothing fails where it does not."""

from __future__ import annotations

import re
import shutil

import pytest

from services.pi_tracker.compiled import library


def test_what_was_compiled_from_these_sources_is_used(compiled_file):
    loaded, state = library.load(compiled_file)
    assert loaded is not None
    assert state == "compiled (tracker.so)"


def test_without_a_compiled_form_it_says_what_to_do(tmp_path):
    loaded, state = library.load(tmp_path / "tracker.so")
    assert loaded is None
    assert state.startswith("in Python: tracker.so is not there; `pip install` compiles it")


@pytest.mark.parametrize("content", [b"", b"no library", b"\x7fELF" + bytes(200)])
def test_a_broken_file_is_no_error(tmp_path, content):
    path = tmp_path / "tracker.so"
    path.write_bytes(content)
    loaded, state = library.load(path)
    assert loaded is None
    assert "tracker.so does not load" in state


def test_one_of_other_sources_is_left_alone(compiled_file, tmp_path):
    """As after `git pull` in an editable installation: its structures may be others."""
    path = tmp_path / "tracker.so"
    shutil.copy(compiled_file, path)
    digest = library._digest()
    content = path.read_bytes()
    assert content.count(digest) == 1
    path.write_bytes(content.replace(digest, b"0" * len(digest)))
    loaded, state = library.load(path)
    assert loaded is None
    assert "is of another version" in state


def test_this_process_has_one_of_both():
    assert (library.loaded is None) == library.state.startswith("in Python: ")
    assert re.match(r"in Python: |compiled \(tracker-", library.state)
