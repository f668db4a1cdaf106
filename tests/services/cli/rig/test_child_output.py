"""A child's lines, and why it ended."""

from __future__ import annotations

import pytest

from services.cli.rig.child_output import ChildOutput, parsed


@pytest.fixture
def lines():
    return []


def output(lines, before=None):
    return ChildOutput(lambda level, text: lines.append((level, text)), before)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('{"level": "warning", "text": "careful"}', ("warning", "careful")),
        ('{"level": "error", "text": "oops", "trace": "a\\nb"}', ("error", "oops\na\nb")),
        (
            '{"level": "info", "who": "fusion/main", "service": "solver", "text": "ready"}',
            ("info", "solver: ready"),
        ),
        ("rhot: error: no router can listen", ("error", "no router can listen")),
        ("rhot-viewer: error: needs viser", ("error", "needs viser")),
        ("plain", ("info", "plain")),
        ('{"text": 3}', ("info", '{"text": 3}')),
        ("[" * 100_000, ("info", "[" * 100_000)),
    ],
)
def test_lines_have_a_level(line, expected):
    assert parsed(line) == expected


def test_the_reason_is_the_last_error_also_under_a_backtrace(lines):
    one = output(lines)
    one.take("rhot: error: no router can listen")
    for number in range(30):
        one.take(f"{number}: tokio::runtime")
    assert one.reason == "no router can listen"


def test_an_error_of_long_ago_is_not_the_reason(lines):
    one = output(lines)
    one.take("rhot: error: a small thing")
    for number in range(100):
        one.take(f"line {number}")
    assert one.last_error == ""
    assert one.reason.splitlines()[-1] == "line 99"
    assert len(one.reason.splitlines()) < 10


def test_what_the_run_before_said_is_not_said_again(lines):
    first = output(lines)
    first.take("rhot: error: no such file")
    second = output(lines, first)
    second.take("starting")
    second.take("rhot: error: no such file")
    third = output(lines, second)
    third.take("rhot: error: another thing")
    assert [text for _, text in lines] == ["no such file", "starting", "another thing"]
    assert second.reason == "no such file"


def test_a_child_that_warns_for_weeks_does_not_fill_the_memory(lines):
    one = output(lines)
    for number in range(10_000):
        one.take(f'{{"level": "warning", "text": "{number}"}}')
    assert len(one.serious) < 100
