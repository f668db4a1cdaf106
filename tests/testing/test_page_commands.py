"""Commands of a page, and how their output is compared with what the page says."""

from __future__ import annotations

import pytest

from testing.page_commands import Command, commands, run, setup

PAGE = """# Page

## First

```sh
hello() { echo "hello $1"; }
```

```console
$ hello world
hello ...
$ echo a \\
  b
...
```

## Second

```console
$ true
```

```
$ not this
```
"""


def test_commands_are_read_with_section_and_output():
    assert commands(PAGE) == [
        Command("First", "hello world", ("hello ...",)),
        Command("First", "echo a   b", ()),
        Command("Second", "true", ()),
    ]
    assert setup(PAGE) == 'hello() { echo "hello $1"; }\n'


@pytest.mark.parametrize(
    ("line", "output", "found"),
    [
        ("wrist ... mm", "a\n  wrist   1.0   2.0 mm\nb", True),
        ("wrist ... mm", "wrist 1.0 m", False),
        ("x y", "x     y", True),
        ("x y", "x y z", False),
        ('{"a": [...], ...}', '{"a": [], "b": 1}', True),
        ("(a|b)", "a", False),
        ("a ... b", "a\nb", False),
    ],
)
def test_a_line_of_the_page_matches_a_line_of_the_output(line, output, found):
    assert (Command("", "", (line,)).missing(output) == []) is found


async def test_a_command_that_ends_gives_its_code_and_output(tmp_path):
    fails = Command("", "hello world; exit 3", ("hello world",))
    assert await run(fails.line, setup(PAGE), tmp_path, fails, 30.0) == (3, "hello world\n")


async def test_a_command_that_goes_on_is_interrupted_when_it_has_said_enough(tmp_path):
    goes_on = Command("", "while true; do date; sleep 0.1; done | cat", ("...:...",))
    code, output = await run(goes_on.line, "set -o pipefail", tmp_path, goes_on, 30.0)
    assert (code, ":" in output) == (0, True)


async def test_a_command_that_never_says_it_is_interrupted_and_found_out(tmp_path):
    silent = Command("", "echo other; exec sleep 60", ("hello",))
    _, output = await run(silent.line, "", tmp_path, silent, 0.5)
    assert silent.missing(output) == ["hello"]
    assert "still running after 0.5 s" in output
