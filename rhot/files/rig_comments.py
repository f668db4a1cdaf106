"""What the comments in rig_tables.py say of each key, for `rhot init` and docs/reference."""

from __future__ import annotations

import inspect

from rhot.files.rig_tables import Table


def comments_of(table: type[Table]) -> dict[str, str]:
    """The comment lines above each key of a table, as one text."""
    found: dict[str, str] = {}
    above: list[str] = []
    tables = [one for one in reversed(table.__mro__) if issubclass(one, Table)]
    for line in (line for one in tables for line in inspect.getsource(one).splitlines()):
        text = line.strip()
        if text.startswith("#"):
            above.append(text.lstrip("# "))
        else:
            name = text.partition(":")[0]
            if above and name.isidentifier():
                found[name] = " ".join(above)
            above = []
    return found
