"""Markers nobody pointed at."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.proposal.paint_names import PAINT_HUES
from services.pi_tracker.colors.proposal.propose import boxes_of, propose
from services.pi_tracker.colors.report import examine
from testing.synthetic_images import PAINTS, ROW_X_PX

SIZE = (240, 160)
FEW = ["green", "blue", "violet"]


@pytest.fixture
def hand(studio, tip):
    def make(colors, count=3, thing=None):
        frames, truths = [], []
        for number in range(count):
            tips = [
                tip(c, ROW_X_PX[c] + 2 * number, 70.0 + 3 * number, width_px=13.0, length_px=14.0)
                for c in colors
            ]
            clean, truth = studio.clean(tips, SIZE)
            if thing is not None:
                clean[10:40, 20:200] = thing
            frames.append(studio.of(studio.bgr(clean, 5.0, number), number))
            truths.append(truth)
        return frames, truths

    return make


def test_six_paints_are_found_named_and_can_be_fitted(hand):
    frames, truths = hand(ROW_X_PX)
    proposals, _ = propose(frames, list(ROW_X_PX))
    assert {one.color for one in proposals} == set(ROW_X_PX)
    for one in proposals:
        for box in one.boxes:
            x, y = truths[box.frame][one.color]
            assert box.x_px <= x <= box.x_px + box.width_px
            assert box.y_px <= y <= box.y_px + box.height_px
    training = gather(frames, boxes_of(proposals))
    assert examine(training, fit(training.samples)).warnings == ()


def test_names_are_those_of_the_rig_where_they_fit(hand):
    frames, _ = hand(["green", "blue"])
    assert {one.color for one in propose(frames, ["blue", "lime"])[0]} == {"blue", "green"}
    assert {one.color for one in propose(frames)[0]} == {"blue", "green"}


def test_furniture_is_not_proposed_and_its_hue_not_suggested(hand):
    frames, _ = hand(["green"], thing=(190, 90, 30))
    proposals, suggestions = propose(frames)
    assert [one.color for one in proposals] == ["green"]
    names = [one.color for one in suggestions]
    assert "blue" not in names
    assert "green" not in names
    assert {"magenta", "violet"} <= set(names)


def test_skin_hues_are_never_suggested(hand):
    frames, _ = hand([])
    proposals, suggestions = propose(frames)
    assert proposals == []
    assert not {"red", "orange"} & {one.color for one in suggestions}
    assert all(one.clearance >= 12.0 for one in suggestions)
    assert set(PAINT_HUES) >= {one.color for one in suggestions}


def test_what_is_seen_in_few_pictures_only_is_passed_over(hand):
    frames, _ = hand(["green", "blue"], count=2)
    more, _ = hand(["green"], count=4)
    assert {one.color for one in propose(frames + more)[0]} == {"green"}


def test_noise_alone_proposes_nothing(studio):
    rng = np.random.default_rng(1)
    noise = np.clip(rng.normal(40.0, 12.0, (SIZE[1], SIZE[0], 3)), 0, 255).astype(np.uint8)
    assert propose([studio.of(noise)])[0] == []


@pytest.fixture
def before_things(studio, tip):
    """Pictures of tips that move, far from larger things of the same paints; where the tips are."""

    def make(count=6, at_rest=()):
        frames, truths = [], []
        for number in range(count):
            tips = [
                tip(
                    color,
                    30.0 + 20.0 * n,
                    80.0 if color in at_rest else 30.0 + 9.0 * number,
                    width_px=13.0,
                    length_px=14.0,
                )
                for n, color in enumerate(FEW)
            ]
            clean, truth = studio.clean(tips, (480, 160))
            for n, color in enumerate(FEW):
                clean[20 + 40 * n : 50 + 40 * n, 400:430] = PAINTS[color]
            frames.append(studio.of(studio.bgr(clean, 5.0, number), number))
            truths.append(truth)
        return frames, truths

    return make


def hits(proposals, truths):
    """Of each colour, in what share of its boxes its tip is."""
    return {
        one.color: sum(
            box.x_px <= truths[box.frame][one.color][0] <= box.x_px + box.width_px
            and box.y_px <= truths[box.frame][one.color][1] <= box.y_px + box.height_px
            for box in one.boxes
        )
        / len(one.boxes)
        for one in proposals
    }


def test_tips_that_move_are_told_from_things_of_their_paint(before_things):
    frames, truths = before_things()
    proposals, _ = propose(frames, FEW)
    assert hits(proposals, truths) == dict.fromkeys(FEW, 1.0)
    assert all(one.moves for one in proposals)


def test_of_a_tip_that_rests_what_is_about_the_others_is_proposed(before_things):
    frames, truths = before_things(at_rest=("violet",))
    proposals, _ = propose(frames, FEW)
    assert hits(proposals, truths) == dict.fromkeys(FEW, 1.0)
    assert {one.color: one.moves for one in proposals} == {
        "green": True, "blue": True, "violet": False
    }  # fmt: skip


def test_one_picture_proposes_what_stands_out_most(before_things):
    frames, truths = before_things(count=1)
    proposals, _ = propose(frames, FEW)
    assert hits(proposals, truths) == dict.fromkeys(FEW, 0.0)
    assert not any(one.moves for one in proposals)
