"""Which paint a patch is by where the others are: hues alone leave it open."""

from __future__ import annotations

import dataclasses

import pytest

from services.pi_tracker.colors.proposal.hand_names import fit_beside, of_a_hand
from services.pi_tracker.colors.proposal.paint_names import paint_names
from services.pi_tracker.colors.proposal.vivid_patches import Patch

MARKS = {
    "violet": ("right", "wrist"),
    "magenta": ("right", "thumb_tip"),
    "blue": ("right", "index_tip"),
    "cyan": ("right", "middle_tip"),
    "green": ("right", "ring_tip"),
    "lime": ("right", "little_tip"),
}
RIG = list(MARKS)
# An open hand, px: tips 14 px wide.
PLACES = {
    "wrist": (300, 330),
    "thumb_tip": (390, 230),
    "index_tip": (330, 150),
    "middle_tip": (300, 140),
    "ring_tip": (270, 150),
    "little_tip": (240, 180),
}


def group(hue, place, pictures=12):
    """A patch of about 14 x 14 px at a place (its middle, px) that drifts by 2 px a picture."""
    x, y = place
    return [Patch(n, hue, 40, 40.0, (x - 7 + 2 * n, y - 7, 14, 14), 0.9) for n in range(pictures)]


def named(hues, groups, **options):
    return paint_names(hues, RIG, set(), surely_paint=True, **options)


def test_warm_light_turns_hues_but_not_places():
    """As pictures in warm light had them: blue is nearer to violet, violet to magenta, and the
    thumb was not found.
    """
    hues = {"little_tip": 34.0, "ring_tip": 51.4, "middle_tip": 95.2, "index_tip": 126.6}
    hues["wrist"] = 144.7
    groups = [group(hue, PLACES[mark]) for mark, hue in hues.items()]
    true = ["lime", "green", "cyan", "blue", "violet"]
    choose = of_a_hand(groups, MARKS)
    assert named(list(hues.values()), groups) != true
    assert named(list(hues.values()), groups, choose=choose) == true


def test_a_ball_that_the_wrist_hides_now_and_then_is_no_little_finger():
    places = [PLACES[mark] for mark in ("index_tip", "middle_tip", "ring_tip", "little_tip")]
    hues, found = [118.0, 98.0, 63.0, 42.0, 54.0], [12, 12, 12, 8, 11]
    groups = [
        group(hue, place, count)
        for hue, place, count in zip(hues, [*places, (420, 420)], found, strict=True)
    ]
    weights = [count / 12 for count in found]
    by_hue = named(hues, groups, weights=weights)
    by_place = named(hues, groups, weights=weights, choose=of_a_hand(groups, MARKS))
    assert by_hue == ["blue", "cyan", "green", "hue42", "lime"]
    assert by_place == ["blue", "cyan", "green", "lime", "hue54"]


def test_without_landmarks_hues_decide():
    hues = [120.0, 60.0, 40.0, 160.0]
    groups = [group(hue, (90 * n, 400)) for n, hue in enumerate(hues)]
    assert named(hues, groups, choose=of_a_hand(groups, {})) == named(hues, groups)
    assert named([], [], choose=of_a_hand([], MARKS)) == []


def test_more_groups_than_a_hand_has_are_named_in_no_time():
    """Test: forty moving things that all may have three names, one on top of the other."""
    hues = [56.0 + 0.1 * n for n in range(40)]
    groups = [group(hue, (300 + n, 300)) for n, hue in enumerate(hues)]
    names = named(hues, groups, choose=of_a_hand(groups, MARKS))
    assert len(set(names) & set(RIG)) >= 1


@pytest.mark.parametrize(
    ("place", "cells", "fits"), [((395, 225), 40, 1), ((760, 40), 40, 0), ((395, 225), 400, 0)]
)
def test_where_and_how_large_a_missing_marker_may_be(place, cells, fits):
    hand = {
        color: group(0.0, PLACES[mark]) for color, (_, mark) in MARKS.items() if color != "magenta"
    }
    found = [dataclasses.replace(patch, cells=cells) for patch in group(172.0, place)]
    assert abs(fit_beside(found, "magenta", hand, MARKS) - fits) < 0.1


def test_nothing_is_known_of_landmarks_without_names_or_others():
    thumb = group(172.0, (760, 40))
    assert fit_beside(thumb, "magenta", {"blue": group(120.0, (330, 150))}, {}) == 1.0
    assert fit_beside(thumb, "magenta", {}, MARKS) == 1.0
