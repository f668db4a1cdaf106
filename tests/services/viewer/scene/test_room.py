"""Where one looks from first: the hands are in sight, beside the panel."""

from __future__ import annotations

import numpy as np
import pytest

from services.viewer.scene.room import first_view

FOV_RAD = np.deg2rad(34.0)


def seen_at(aspect: float, hands: int, point: np.ndarray) -> np.ndarray:
    """Where a point of the first camera's frame is on the page: 0..1 from the left and the top."""
    viewpoint, look_at = first_view(aspect, hands)
    ahead = (look_at - viewpoint) / np.linalg.norm(look_at - viewpoint)
    right = np.cross(ahead, [0.0, -1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(ahead, right)
    from_eye = point - viewpoint
    half = np.tan(0.5 * FOV_RAD) * (from_eye @ ahead)
    page: np.ndarray = 0.5 + 0.5 * np.array([from_eye @ right / aspect, from_eye @ down]) / half
    return page


# A page of 1280x800 has 876 pixels beside the panel; a phone's panel covers the lower half.
@pytest.mark.parametrize(("aspect", "free"), [(876 / 800, (0.8, 0.8)), (390 / 844, (1.0, 0.5))])
@pytest.mark.parametrize("hands", [1, 2])
def test_hands_are_beside_the_panel(aspect: float, free: tuple[float, float], hands: int) -> None:
    for side in (-1.0, 1.0) if hands == 2 else (0.0,):
        for x, y in ((-0.06, -0.06), (0.06, -0.06), (-0.06, 0.06), (0.06, 0.06)):
            at = seen_at(aspect, hands, np.array([0.115 * side + x, y, 0.5]))
            assert np.all(at > 0.0)
            assert np.all(at < free)


def test_a_hand_takes_a_third_to_a_half_of_a_wide_page() -> None:
    top, bottom = (seen_at(876 / 800, 1, np.array([0.0, y, 0.5]))[1] for y in (-0.1, 0.1))
    assert 0.3 < bottom - top < 0.6
