"""Progress shows on a terminal, and elsewhere only if asked for."""

from __future__ import annotations

import io

from services.cli.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_gets_one_line_that_is_overwritten_and_taken_away():
    out = Terminal()
    progress = Progress("work:", 10, True, out)
    progress.period_s = 0.0
    progress.advance(3)
    progress.advance(2)
    progress.end()
    text = out.getvalue()
    assert "work: 3/10 (30 %)" in text
    assert "work: 5/10 (50 %)" in text
    assert text.endswith("\r\033[K")


def test_a_pipe_gets_nothing_unless_asked():
    for shown, count in ((None, 0), (False, 0), (True, 1)):
        out = io.StringIO()
        progress = Progress("work:", 0, shown, out)
        progress.period_s = 0.0
        progress.advance()
        progress.end()
        assert out.getvalue().count("work: 1,") == count
