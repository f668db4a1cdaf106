"""`rhot init` on a terminal: asks for what the options have left open, each with its default."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import typer

from rhot.errors import ConfigError

T = TypeVar("T")


class Questions:
    """Asks, or takes the defaults where nobody is there to answer."""

    def __init__(self, *, asks: bool) -> None:
        self._asks = asks

    def answer(
        self, question: str, given: str | None, default: str, parse: Callable[[str], T]
    ) -> T:
        """What was given as an option, else what is typed, else the default; parsed.

        A wrong option raises ConfigError; a wrong answer is asked for again.
        """
        if given is not None or not self._asks:
            return parse(default if given is None else given)
        while True:
            # No default in brackets where it is empty: typer would ask for ever.
            typed = str(typer.prompt(question, default=default, show_default=bool(default)))
            try:
                return parse(typed.strip())
            except ConfigError as error:
                typer.echo(f"  {error}")
