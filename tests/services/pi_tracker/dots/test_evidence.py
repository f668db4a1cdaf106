"""Right names make pictures likelier than wrong ones."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.dots.evidence import Judge
from services.pi_tracker.dots.hypothesis import Patches
from services.pi_tracker.dots.tracker import DotTracker, arrays_of
from testing.dot_patches import NAMES, REST, SIZE, patches_at

RIGHT = tuple(range(8))
TIMES = [k / 30 for k in range(12)]


def _pictures() -> list[Patches]:
    return [arrays_of(patches_at(REST + np.array([4.0, -2.0]) * k)) for k in range(12)]


def _judge(told: list[tuple[int, ...]], pictures: list[Patches]) -> Judge:
    tracker = DotTracker(NAMES, SIZE)
    tracker.step(patches_at(REST), 0.0)
    assert tracker.begun is not None
    return Judge(tracker.begun, pictures, TIMES, told)


def _evidence(told: list[tuple[int, ...]], pictures: list[Patches]) -> float:
    return list(_judge(told, pictures).retraced(told))[-1].nats


def test_exchanged_and_missing_names_are_less_likely() -> None:
    pictures = _pictures()
    right = _evidence([RIGHT] * 12, pictures)
    tips = (0, 1, 2, 7, 4, 5, 6, 3)
    assert _evidence([RIGHT] * 6 + [tips] * 6, pictures) < right - 10.0
    joints = (0, 2, 1, 3, 4, 5, 6, 7)
    assert _evidence([RIGHT] * 4 + [joints] * 4 + [RIGHT] * 4, pictures) < right - 10.0
    lost = (0, 1, 2, -1, 4, 5, 6, 7)
    assert _evidence([RIGHT] * 6 + [lost] * 6, pictures) < right - 10.0


def test_sizes_are_learned_from_each_account_and_not_from_a_rough_one() -> None:
    """A large dot and a small one that a rough account exchanges from the second picture on."""
    exchanged = (0, 1, 2, 7, 4, 5, 6, 3)
    large = np.array([1.0, 1.0, 1.0, 4.0, 1.0, 1.0, 1.0, 1.0])
    pictures = [one._replace(areas=one.areas * large) for one in _pictures()]
    right, rough = [RIGHT] * 12, [RIGHT] + [exchanged] * 11
    by_rough = list(_judge(rough, pictures).retraced(right))[-1]
    assert by_rough.nats == list(_judge(right, pictures).retraced(right))[-1].nats
    np.testing.assert_allclose(by_rough.areas, pictures[0].areas)
    # What is half hidden for a while is no smaller for good.
    half = [
        one._replace(areas=one.areas / 2.0) if k == 6 else one for k, one in enumerate(pictures)
    ]
    after = list(_judge(right, half).retraced(right))[-1]
    assert np.all(after.areas > 0.85 * pictures[0].areas)


def test_a_dot_that_is_hidden_is_told_so() -> None:
    pictures = _pictures()
    for k in (5, 6, 7):
        own = REST + np.array([4.0, -2.0]) * k
        pictures[k] = arrays_of(patches_at(np.delete(own, 3, axis=0)))
    hidden, shared = (0, 1, 2, -1, 3, 4, 5, 6), (0, 1, 2, 3, 3, 4, 5, 6)
    told = [RIGHT] * 5 + [hidden] * 3 + [RIGHT] * 4
    assert _evidence(told, pictures) > _evidence([RIGHT] * 5 + [shared] * 3 + [RIGHT] * 4, pictures)


def test_no_dot_needs_to_be_seen_and_one_picture_is_none_after_the_first() -> None:
    pictures, nothing = _pictures(), (-1,) * 8
    assert np.isfinite(_evidence([RIGHT] + [nothing] * 11, pictures))
    empty = [pictures[0], *[arrays_of([])] * 11]
    assert np.isfinite(_evidence([RIGHT] + [nothing] * 11, empty))
    assert np.isfinite(_evidence([RIGHT], pictures[:1]))


def test_backwards_the_same_names_are_right() -> None:
    pictures, right = _pictures(), [RIGHT] * 12
    judge = _judge(right, pictures)
    back = judge.backwards(list(judge.retraced(right))[-1])
    traces = list(back.retraced(right))
    pixels, _ = judge.body.project(*traces[-1].states[:4])
    assert np.abs(pixels[0] - pictures[0].places).max() < 3.0
    tips = (0, 1, 2, 7, 4, 5, 6, 3)
    exchanged = list(back.retraced([RIGHT] * 6 + [tips] * 6))
    assert exchanged[-1].nats < traces[-1].nats - 10.0
    # Where the hand goes backwards, too.
    ahead = list(judge.retraced(right))[6].states.means[0, judge.body.size :][:2]
    behind = traces[6].states.means[0, judge.body.size :][:2]
    assert np.all(ahead * behind < 0.0)
