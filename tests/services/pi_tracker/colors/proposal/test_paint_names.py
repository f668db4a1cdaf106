"""What paints are called by their hue."""

from __future__ import annotations

from services.pi_tracker.colors.proposal.paint_names import paint_names

RIG = ["violet", "magenta", "blue", "cyan", "green", "lime"]


def test_the_nearest_name_of_the_rig_is_taken_first():
    assert paint_names([67.0, 160.0], RIG, set()) == ["green", "magenta"]
    assert paint_names([53.0], ["green", "leaf"], set()) == ["leaf"]


def test_a_light_that_turns_all_hues_leaves_no_colour_without_a_name():
    # As pictures in warm light had them: blue is nearer to violet than to itself.
    hues = [173.4, 36.6, 123.5, 92.3, 54.2, 145.1]
    assert paint_names(hues, RIG, set()) == ["magenta", "lime", "blue", "cyan", "green", "violet"]


def test_what_is_surely_paint_may_be_farther_from_its_name():
    assert paint_names([172.0, 151.0], RIG, set()) == ["red", "magenta"]
    assert paint_names([172.0, 151.0], RIG, set(), surely_paint=True) == ["magenta", "violet"]
    # Not one that has another name for sure.
    assert paint_names([58.0], ["lime"], set(), surely_paint=True) == ["green"]


def test_names_that_are_taken_and_hues_far_from_all_get_others():
    assert paint_names([112.0], RIG, {"blue"}) == ["hue112"]
    assert paint_names([15.0, 80.0], RIG, set()) == ["orange", "cyan"]
    assert paint_names([78.0], ["blue"], {"green", "cyan"}) == ["hue78"]
    assert paint_names([], RIG, set()) == []
