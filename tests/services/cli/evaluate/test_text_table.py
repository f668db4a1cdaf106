"""Tables line up, and what was not measured is a dash."""

from __future__ import annotations

from services.cli.evaluate.text_table import number, plain, table


def test_columns_line_up():
    lines = table(("name", "a", "b"), [("x", "1.00", "20"), ("longer", "-3.50", "")]).splitlines()
    assert lines[0] == "name        a   b"
    assert lines[2] == "x        1.00  20"
    assert lines[3] == "longer  -3.50"


def test_rows_without_a_header_line_up_to_the_left():
    assert plain([("a", "long"), ("bb", "x")]) == "a   long\nbb  x"


def test_numbers_have_no_negative_zero_and_a_dash_for_none():
    assert [number(-0.001), number(1.25, 1), number(None)] == ["0.00", "1.2", "-"]
