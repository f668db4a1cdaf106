"""`make docs`: write every generated page, and every table of figures from docs/figures/*.json."""

from __future__ import annotations

import sys

from docs.generate.figures import MissingFigureError
from docs.generate.pages import stale


def main() -> int:
    """Write what is not as it should be, and name it."""
    try:
        pages = stale()
    except MissingFigureError as error:
        print(f"make docs: {error}", file=sys.stderr)
        return 2
    for path, text in pages.items():
        path.write_text(text, encoding="utf-8")
        print(f"written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
