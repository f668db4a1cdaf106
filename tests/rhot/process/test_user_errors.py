"""What the user can mend is told from bugs."""

from __future__ import annotations

import errno
import os

import pytest

from rhot.errors import SourceError
from rhot.process.user_errors import user_errors


def test_a_full_disk_is_one_line_that_names_the_file():
    with (
        pytest.raises(OSError, match="No space") as caught,
        open("/dev/full", "wb", buffering=0) as full,
    ):
        full.write(b"x")
    caught.value.filename = "out/markers.jsonl"
    (error,) = user_errors(caught.value, "rhot")
    assert str(error).startswith("out/markers.jsonl: the disk is full")
    assert "df -h" in str(error)


def test_a_group_is_the_users_only_as_a_whole():
    full, source = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), SourceError("plug it in")
    assert len(user_errors(ExceptionGroup("both", [full, source]), "rhot")) == 2
    assert not user_errors(ExceptionGroup("one is a bug", [full, KeyError("x")]), "rhot")
    assert not user_errors(OSError(errno.EIO, "broken"), "rhot")
