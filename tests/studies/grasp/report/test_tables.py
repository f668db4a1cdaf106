"""Tables in three forms; names of people are text, never markup."""

from __future__ import annotations

import csv

from studies.grasp.report.tables import Table, mean_sd, number

TABLE = Table("t", "A <title>", ["who", "a|b"], [["<b>anna</b>", "1,5"], ["x|y", ""]], "note & so")


def test_html_escapes_what_people_wrote():
    text = TABLE.html()
    assert "<b>" not in text
    assert "&lt;b&gt;anna&lt;/b&gt;" in text
    assert "note &amp; so" in text
    assert "&ndash;" in text


def test_markdown_keeps_its_columns():
    rows = [line for line in TABLE.markdown().splitlines() if line.startswith("|")]
    assert rows[0] == "| who | a\\|b |"
    assert rows[3] == "| x\\|y |  |"


def test_csv_is_read_back():
    assert list(csv.reader(TABLE.csv().splitlines())) == [TABLE.header, *TABLE.rows]


def test_numbers():
    assert number(None) == number(float("nan")) == ""
    assert number(1.26) == "1.3"
    assert mean_sd((92.4, 3.1)) == "92 ± 3"
    assert mean_sd((92.4, float("nan"))) == "92"
