"""Dots that hang on no hand are followed all the same, and none is told where another one is."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from services.pi_tracker.dots import either
from services.pi_tracker.dots.dot import Dot, Patch, SeenPatches
from services.pi_tracker.dots.either import EitherTracker
from services.pi_tracker.dots.hindsight.looking_back import look_back
from services.pi_tracker.dots.search import CLOUD, LIVE, Search
from services.pi_tracker.dots.tracker import DotTracker
from testing.dot_pictures import NAMES, SIZE

RATE = 30.0


def _scattered() -> np.ndarray:
    """A plate's eight dots about its middle, px."""
    return np.random.default_rng(5).uniform(-85.0, 85.0, (8, 2))


def _beads() -> np.ndarray:
    return np.stack([36.0 * np.arange(8.0) - 126.0, np.zeros(8)], axis=1)


def _moved(body: np.ndarray, number: int) -> np.ndarray:
    """A body that shifts by up to 12 px a picture, and turns."""
    t_s = number / RATE
    angle = 0.35 * np.sin(3.0 * t_s)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = np.array([90.0 * np.sin(2.6 * t_s + 0.4), 45.0 * np.sin(3.4 * t_s)])
    return np.array([320.0, 180.0]) + shift + body @ turn.T


def _pictures(body: np.ndarray, hidden: dict[int, range]) -> list[tuple[np.ndarray, SeenPatches]]:
    random = np.random.default_rng(6)
    found = []
    for number in range(60):
        places = _moved(body, number)
        shown = [k for k in range(8) if number not in hidden.get(k, ())]
        random.shuffle(shown)
        patches = [
            Patch(*(places[k] + random.normal(0.0, 0.3, 2)).tolist(), area_px=180.0) for k in shown
        ]
        found.append((places, SeenPatches(number / RATE, patches)))
    return found


def _wrong(dots: dict[str, Dot], places: np.ndarray) -> list[str]:
    return [
        name
        for name, place in zip(NAMES, places, strict=True)
        if name in dots
        and dots[name].state != "carried"
        and np.hypot(dots[name].x_px - place[0], dots[name].y_px - place[1]) > 5.0
    ]


@pytest.mark.parametrize("body", [_scattered(), _beads()], ids=["plate", "beads"])
def test_what_is_no_hand_is_followed(body: np.ndarray) -> None:
    """Expected: after a few pictures all dots are told, right; two that were hidden come back."""
    hidden = {2: range(25, 31), 5: range(28, 33)}
    seeds = {name: tuple(place) for name, place in zip(NAMES, _moved(body, 0), strict=True)}
    tracker = EitherTracker(NAMES, SIZE, seeds)
    told = 0
    for number, (places, seen) in enumerate(_pictures(body, hidden)):
        dots = tracker.step(seen.patches, seen.time_s)
        if number >= 5:
            assert not _wrong(dots, places), number
            told += sum(dot.state != "carried" for dot in dots.values())
    assert told >= 0.99 * (55 * 8 - 11)


def test_hindsight_follows_what_is_no_hand() -> None:
    pictures = _pictures(_scattered(), {2: range(25, 31)})
    seeds = {n: tuple(p) for n, p in zip(NAMES, pictures[0][0], strict=True)}

    def begin(search: Search) -> DotTracker:
        return DotTracker(NAMES, SIZE, seeds, search, remembers=True)

    looked = look_back(begin, [seen for _, seen in pictures], lambda: None)
    for (places, _), dots in zip(pictures, looked, strict=True):
        assert not _wrong(dots, places)
        assert len(dots) >= 7


class _Told:
    """A tracker that says what it is told to: of a hand, or of a cloud."""

    names = NAMES
    nats = 0.0
    # What the next picture gains a cloud over a hand, nats of all dots; how far the first is from
    # a hand's.
    ahead, misfit = 0.0, 0.0

    def __init__(self, *given: object) -> None:
        self.is_cloud = given[-1] == CLOUD
        self.begun: object | None = None
        self.gained = 0.0

    def step(self, patches: list[Patch], time_s: float) -> dict[str, str]:
        self.begun = self
        self.gained = self.ahead if self.is_cloud else 0.0
        return {"told": "cloud" if self.is_cloud else "hand"}


def _told(monkeypatch: pytest.MonkeyPatch, misfit: float, *stretches: tuple[float, int]) -> str:
    """h or c of each picture: a first, and stretches of nats that a cloud gains by each dot."""
    monkeypatch.setattr(either, "DotTracker", _Told)
    monkeypatch.setattr(_Told, "misfit", misfit)
    tracker, told = EitherTracker(NAMES, SIZE), ""
    for nats, count in [(0.0, 1), *stretches]:
        monkeypatch.setattr(_Told, "ahead", nats * len(NAMES))
        for _ in range(count):
            told += dict(tracker.step([], 0.0))["told"][0]
    return told


def test_a_hand_is_told_until_much_speaks_against_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: 3 nats of each dot are what hands cost at worst; 30 beyond that are enough."""
    assert _told(monkeypatch, 10.0, (2.9, 100)) == "h" * 101
    told = _told(monkeypatch, 10.0, (6.0, 20))
    assert told == "h" * 11 + "c" * 10
    # A few bad pictures are made up for by those that follow.
    assert _told(monkeypatch, 10.0, (6.0, 9), (0.0, 9), (6.0, 9)) == "h" * 28


def test_what_is_believed_to_be_no_hand_is_one_only_after_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Expected: by a half nat of each picture, when both are as likely, from 30 on."""
    told = _told(monkeypatch, 10.0, (6.0, 11), (0.0, 65))
    assert told == "h" * 11 + "c" * 60 + "h" * 6


def test_a_first_picture_that_is_no_hands_is_a_clouds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: told as one, but for the first picture; a hand after less than one later."""
    told = _told(monkeypatch, 34.0, (1.0, 50))
    assert told == "c" * 51
    assert _told(monkeypatch, 34.0, (0.0, 25)) == "c" * 20 + "h" * 6
    assert _told(monkeypatch, 11.0, (0.0, 25)) == "h" * 26


@pytest.mark.parametrize(
    ("misfit", "nats", "cloud"),
    [(10.0, 1.4, False), (10.0, 1.6, True), (34.0, 0.4, False), (34.0, 0.6, True)],
)
def test_a_whole_recording_is_no_hands_by_what_its_pictures_say_on_average(
    misfit: float, nats: float, cloud: bool
) -> None:
    hand, other = _Told(LIVE), _Told(CLOUD)
    hand.misfit, other.nats = misfit, nats * len(NAMES) * 60
    assert either.is_cloud(cast("DotTracker", hand), cast("DotTracker", other), 60) == cloud
