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
    # Whether an assignment is updated with each acceleration that it may have come by, not only
    # with the one that looks the likeliest before.
    each_acceleration: bool = False
    # Accounts that began with different postures are searched apart, each posture as widely as all
    # are otherwise, until it is so much (nats) less likely than the best; 0: all together.
    apart_nats: float = 0.0
    # Whether dots hang on nothing that is known (body/cloud.py), not on a hand.
    cloud: bool = False


LIVE, CLOUD = Search(), Search(cloud=True)
# The right posture may be 25 nats less likely than others for 10 pictures, and be the likeliest by
# hundreds after 20. (Live, with true names retraced, that of 15 dots of `grab`, seeds 0 and 6; most
# postures are given up by then, so that 40 nats take half as long again as none.)
_APART_NATS = 40.0
# A recording is searched in each of these ways from its start (looking_back.py): what counts is
# that they err at different pictures.
SEVERAL = (
    Search(apart_nats=_APART_NATS),
    Search(beam=96, updated=96, each_acceleration=True, apart_nats=_APART_NATS),
)
# And from pictures in the middle of it so (again.py). (Of 15 dots of `grab`, seed 9, 57 % are right
# before resumed.py if 48 partial assignments are kept and 24 updated, 95 % so.)
AGAIN = Search(beam=192, updated=12, kept=8, apart_nats=_APART_NATS)
