"""What other programs build on changes only on purpose."""

from __future__ import annotations

import rhot
from testing.public_names import LIST, public_names


def test_the_public_names_are_those_of_the_list():
    listed, there = LIST.read_text().splitlines(), public_names()
    gone = sorted(set(listed) - set(there))
    new = sorted(set(there) - set(listed))
    assert listed == there, (
        f"gone: {gone}; new: {new}. If that is meant: python -m testing.public_names --write, "
        "and a line in CHANGELOG.md"
    )


def test_what_the_package_itself_offers():
    assert sorted(rhot.__all__) == ["BlockingRig", "RigClient", "connect", "open", "run"]
    for name in rhot.__all__:
        assert getattr(rhot, name).__doc__
