"""How widely the accounts of dots are searched. Pure data."""

from __future__ import annotations

from typing import NamedTuple


class Search(NamedTuple):
    """Widths of the search; what a picture may be explained by beyond them is given up."""

    # Partial assignments that are kept while a picture is explained, dot by dot (extend.py).
    # (15 dots of `grab`, seeds 2, 4 and 0: 72, 46 and 83 % right; with 192, and four times as many
    # kept, 74, 45 and 67 %; with 600 86, 56 and 80 %, in eight times the time.)
    beam: int = 48
    # Whole ones that are updated exactly.
    updated: int = 24
    # Accounts that are kept, and of those that agree in the last two pictures so many. (12 and 3
    # gave up right postures of 15 dots of `grab`, seeds 2 and 3, with an earlier search; with
    # extend.py's they were not chosen anew.)
    kept: int = 16
    alike: int = 8


LIVE = Search()
# A recording is searched in each of these ways, and the one with the most evidence counts
# (looking_back.py). Which is best differs from one recording to the next, the widest not being
# right more often: what counts is that they err at different pictures.
SEVERAL = (LIVE, Search(192, 96, 64, 32), Search(48, 96, 64, 16), Search(96, 48, 32, 4))
