"""Strangers' texts lose what a terminal would act on."""

from __future__ import annotations

import pytest

from rhot.plain_text import clipped, columns, printable


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("\x1b[2J\x1b]0;mine\x07gone", " [2J ]0;mine gone"),
        ("two\nlines\r\tand more", "two lines  and more"),
        ("left\u202eright", "left right"),
        ("C1 \x9b31m", "C1  31m"),
        ("größer 手", "größer 手"),
    ],
)
def test_control_characters_become_spaces(text, expected):
    assert printable(text) == expected


@pytest.mark.parametrize("width", [0, 1, 5, 8, 20])
@pytest.mark.parametrize("text", ["short", "a longer sentence", "手手手手手手", "e\u0301" * 12])
def test_clipped_text_fits(text, width):
    assert columns(clipped(text, width)) <= width
    if columns(text) <= width:
        assert clipped(text, width) == text
