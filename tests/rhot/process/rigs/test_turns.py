"""Rigs of one process take turns with what each does every second."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.process.rigs.turns import until_turn_s

RIGS = [f"room{n}" for n in range(32)]


def beats(rig: str, period_s: float, began_s: float, count: int, early_s: float = 0.0) -> list:
    """When a rig that waits for its turns has them; its timer goes off early_s before."""
    times_s = [began_s]
    while len(times_s) <= count:
        times_s.append(times_s[-1] + until_turn_s(rig, period_s, times_s[-1]) - early_s)
    return times_s[1:]


@pytest.mark.parametrize("period_s", [1.0, 5.0])
def test_rigs_that_began_together_do_not_beat_together(period_s):
    first_s, second_s = np.array([beats(rig, period_s, 1234.5, 2) for rig in RIGS]).T
    assert np.all((0.5 * period_s <= first_s - 1234.5) & (first_s - 1234.5 <= 1.5 * period_s))
    assert second_s - first_s == pytest.approx(period_s)
    counts, _ = np.histogram(np.sort(second_s % period_s), 10, (0.0, period_s))
    assert counts.max() <= 8


def test_rigs_that_were_held_up_together_part_again():
    held_up_s = [beats(rig, 1.0, 99.0 + 0.3, 1)[0] for rig in RIGS]
    undisturbed_s = [beats(rig, 1.0, 50.0, 1)[0] for rig in RIGS]
    assert np.mod(held_up_s, 1.0) == pytest.approx(np.mod(undisturbed_s, 1.0))


def test_a_timer_that_goes_off_early_makes_no_second_turn():
    times_s = beats("desk", 1.0, 7.0, 20, early_s=0.001)
    assert np.diff(times_s).min() > 0.99
