"""Of several accounts the right parts are put together."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.dots.evidence import Judge, Told
from services.pi_tracker.dots.hindsight.weaving import Account, woven
from services.pi_tracker.dots.tracker import DotTracker, arrays_of
from testing.dot_patches import NAMES, REST, SIZE, patches_at

COUNT = 64
RIGHT: Told = tuple(range(8))
TIPS: Told = (0, 1, 2, 7, 4, 5, 6, 3)
JOINTS: Told = (0, 2, 1, 3, 4, 5, 6, 7)


def _woven(*accounts: Account) -> list[Told]:
    tracker = DotTracker(NAMES, SIZE)
    tracker.step(patches_at(REST), 0.0)
    assert tracker.begun is not None
    pictures = [arrays_of(patches_at(REST + np.array([4.0, -2.0]) * k)) for k in range(COUNT)]
    times = [k / 30 for k in range(COUNT)]
    judge = Judge(tracker.begun, pictures, times, [RIGHT] * COUNT)
    return woven(judge, accounts, COUNT)


def _account(told: list[Told], first: int = 0) -> Account:
    return dict(enumerate(told, first))


def test_accounts_that_err_at_different_pictures_correct_each_other() -> None:
    early = _account([RIGHT] * 3 + [TIPS] * 5 + [RIGHT] * 56)
    late = _account([RIGHT] * 40 + [JOINTS] * 6 + [RIGHT] * 18)
    assert _woven(early, late) == [RIGHT] * COUNT


def test_an_account_of_some_pictures_counts_there() -> None:
    wrong = _account([RIGHT] * 24 + [TIPS] * 10 + [RIGHT] * 30)
    middle = _account([RIGHT] * 54, 2)
    assert _woven(wrong, middle) == [RIGHT] * COUNT
    never = _account([JOINTS] * 54, 2)
    assert _woven(wrong, never) == list(wrong.values())


def test_names_of_the_first_picture_stand() -> None:
    assert _woven(_account([RIGHT] * COUNT), _account([TIPS] * COUNT)) == [RIGHT] * COUNT
    exchanged = _account([TIPS] * COUNT)
    assert _woven(exchanged, _account([RIGHT] * COUNT)) == [TIPS] * COUNT


def test_an_account_may_go_on_to_the_end() -> None:
    lost = _account([RIGHT] * 32 + [TIPS] * 32)
    assert _woven(lost, _account([RIGHT] * (COUNT - 5), 5)) == [RIGHT] * COUNT


def test_accounts_that_nearly_agree_go_on_from_the_much_likelier_past() -> None:
    """One loses most dots early, the other late; between, they differ in one dot."""
    lost: Told = (0, 1, -1, -1, -1, -1, -1, -1)
    other: Told = (0, 1, 2, 3, 4, 5, 6, -1)
    early = _account([RIGHT] * 2 + [lost] * 20 + [RIGHT] * 42)
    late = _account([RIGHT] * 22 + [other] * 20 + [lost] * 22)
    # From the second's past to the first, though they are never alike for long.
    told = _woven(late, early)
    assert told[:22] == [RIGHT] * 22
    assert told[42:] == [RIGHT] * 22
    # Names that are exchanged are not nearly alike: then neither is mended.
    other = (0, 1, 2, 3, 4, 5, 7, 6)
    exchanged = _account([RIGHT] * 22 + [other] * 20 + [lost] * 22)
    assert _woven(exchanged, early) in (list(exchanged.values()), list(early.values()))
