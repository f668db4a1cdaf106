"""Joints that were not seen for a moment."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.measure.gaps import bridged
from studies.grasp.measure.joints import Place, Seen


def way(time_s):
    return 100.0 + 200.0 * time_s + 300.0 * time_s**2, 50.0 - 80.0 * time_s


def pictures(missing):
    found = []
    for number in range(20):
        time_s = number / 30.0
        lost = {"index_tip": "its dot is not seen"} if number in missing else {}
        places = {} if lost else {"index_tip": Place(*way(time_s), 0.2)}
        found.append(Seen(number, time_s, places, lost))
    return found


def test_a_short_gap_is_bridged_and_told():
    seen = bridged(pictures({7, 8}))
    for number in (7, 8):
        place = seen[number].places["index_tip"]
        assert place[:2] == pytest.approx(way(number / 30.0), abs=1e-6)
        assert 0.2 < place.sigma_px < 0.5
        assert place.quality == pytest.approx(0.3)
        assert seen[number].lost == {
            "index_tip": "its dot is not seen (its place is from the pictures around)"
        }
    assert seen[6] == pictures({7, 8})[6]


@pytest.mark.parametrize("missing", [set(range(5, 9)), {0, 1}, {18, 19}, set(range(20))])
def test_what_nobody_knows_stays_lost(missing):
    given = pictures(missing)
    assert bridged(given) == given


def test_between_pictures_that_come_at_odd_times():
    given = pictures({7})
    times = np.cumsum(np.random.default_rng(1).uniform(0.01, 0.06, 20))
    odd = [
        one._replace(
            time_s=float(t),
            places={name: Place(*way(t), 0.2) for name in one.places},
        )
        for one, t in zip(given, times, strict=True)
    ]
    assert bridged(odd)[7].places["index_tip"][:2] == pytest.approx(way(times[7]), abs=1e-6)
