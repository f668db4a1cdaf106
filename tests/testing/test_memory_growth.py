"""What is called growth of memory: leaks are, a step of a heap is not."""

from __future__ import annotations

import numpy as np
import pytest

from testing.memory_growth import Growth, memory_growth

LIMIT_MB_H = 1.0
# As in a soak run: a sample every 5 s for half an hour.
TIMES_S = np.arange(0.0, 1800.0, 5.0)
PAGE_MB = 4096 / 1e6


def growth(megabytes: np.ndarray) -> Growth:
    whole_pages = np.round((70.0 + megabytes) / PAGE_MB) * PAGE_MB
    return memory_growth(TIMES_S, whole_pages, LIMIT_MB_H)


def noise(seed: int, sigma_mb: float = 0.05) -> np.ndarray:
    """A heap that goes up and down: alike within a minute."""
    rng = np.random.default_rng(seed)
    values = np.zeros(len(TIMES_S))
    for i in range(1, len(values)):
        values[i] = 0.9 * values[i - 1] + sigma_mb * np.sqrt(1.0 - 0.9**2) * rng.normal()
    return values


def leak(mb_h: float) -> np.ndarray:
    return mb_h * TIMES_S / 3600.0


def step(mb: float, at_s: float) -> np.ndarray:
    return mb * (at_s <= TIMES_S)


def is_told(found: Growth) -> bool:
    return found.mb_h > LIMIT_MB_H and found.low_mb_h > 0.0


@pytest.mark.parametrize("seed", range(5))
def test_a_leak_of_little_more_than_the_limit_is_told(seed: int) -> None:
    found = growth(leak(1.4) + noise(seed))
    assert is_told(found)
    assert found.low_mb_h < 1.4 < found.high_mb_h
    assert found.step_mb == 0.0


@pytest.mark.parametrize("at_s", [300.0, 900.0, 1500.0])
def test_one_step_is_no_growth_and_is_named(at_s: float) -> None:
    found = growth(step(1.3, at_s) + noise(1))
    assert abs(found.mb_h) < 0.5
    assert found.step_mb == pytest.approx(1.3, abs=0.2)


def test_a_leak_behind_a_step_is_told() -> None:
    found = growth(leak(2.0) + step(1.3, 900.0) + noise(2))
    assert is_told(found)
    assert found.mb_h == pytest.approx(2.0, abs=0.7)


def test_steps_that_go_on_are_growth() -> None:
    """A leak with each fault of one kind, and one of an allocator that asks for 132 kB at once."""
    faults = sum(step(0.1, at_s) for at_s in np.arange(120.0, 1800.0, 140.0))
    assert is_told(growth(faults + noise(3)))
    assert is_told(growth(0.132 * np.floor(leak(2.0) / 0.132) + noise(4)))
    assert is_told(growth(step(0.6, 500.0) + step(0.6, 1200.0) + noise(5)))


def test_what_stays_or_shrinks_is_no_growth() -> None:
    assert growth(np.zeros(len(TIMES_S))).mb_h == pytest.approx(0.0, abs=1e-6)
    assert not is_told(growth(noise(6, sigma_mb=0.3)))
    shrunk = growth(step(-1.0, 900.0) + noise(7))
    assert abs(shrunk.mb_h) < 0.5
    assert shrunk.step_mb == pytest.approx(-1.0, abs=0.2)


@pytest.mark.parametrize("period_s", [600.0, 900.0])
def test_a_heap_that_fills_and_empties_is_no_growth(period_s: float) -> None:
    filled = leak(1.5) - 1.5 * period_s / 3600.0 * np.floor(TIMES_S / period_s)
    assert not is_told(growth(filled + noise(8)))
    # One that gives back what it had before goes on growing.
    assert is_told(growth(leak(2.0) + step(-1.0, 900.0) + noise(9)))


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 48"):
        memory_growth(TIMES_S[:47], np.zeros(47), LIMIT_MB_H)
