"""What moves with a hand, and what stands still beside it or was taken for it."""

from __future__ import annotations

import pytest

from services.pi_tracker.identify.marker_identity import MarkerIdentity
from testing.synthetic_blobs import COLORS, FRAME_NS, START_NS, associated, hand_blobs, square_blob


@pytest.mark.parametrize(("dx_px", "dy_px"), [(8, 0), (0, -8)])
def test_what_stands_still_is_given_up_for_what_the_hand_carries_along(dx_px, dy_px):
    """A thing was taken for a tip from the first frame on, and looks more like itself than it."""
    identity = MarkerIdentity(COLORS, 40)
    thing = square_blob(2, 260, 140, 26)
    for seq in range(6):
        tips = hand_blobs(300 + dx_px * seq, 250 + dy_px * seq)
        blobs = [[tip] if tip.color != 2 or seq == 0 else [thing, tip] for tip in tips]
        blobs[2] = [thing] if seq == 0 else blobs[2]
        found = associated(identity, blobs, seq)[2]
        if seq < 2:
            assert found is thing
    assert found is tips[2]


def test_what_was_taken_for_a_tip_does_not_tell_how_the_hand_moves():
    """The markers that leave no choice went far enough to tell; with the thing's, half as far."""
    identity = MarkerIdentity(COLORS, 40)
    whole = hand_blobs(300, 250)
    for seq in range(6):
        # Shadows pass over it: it is not quite still.
        thing = square_blob(2, 260 + 4 * (seq % 2), 140, 26)
        # A hand that bends at the wrist: fingers go 20 px and more, thumb and wrist 4.
        share = min(seq, 4) / 4
        ways_px = [4, 22, 20, 20, 22, 4]
        tips = [
            square_blob(tip.color, tip.x_px, tip.y_px - share * way_px)
            for tip, way_px in zip(whole, ways_px, strict=True)
        ]
        blobs = [[tip] for tip in tips]
        blobs[2] = [thing, tips[2]] if seq else [thing]
        found = associated(identity, blobs, seq)
    assert found[2] is tips[2]


def test_a_thumb_that_lies_still_stays_one_while_the_fingers_move():
    identity = MarkerIdentity(COLORS, 40)
    thumb = square_blob(0, 240, 230)
    for seq in range(12):
        tips = hand_blobs(300, 250 - 6 * seq)
        speck = square_blob(0, 400 + 60 * (seq % 2), 300, 8)
        blobs = [[tip] for tip in tips]
        blobs[0] = [thumb, speck]
        assert associated(identity, blobs, seq)[0] is thumb


# Things as far from one another, and as large, as a hand's markers are.
THINGS = hand_blobs(150, 300, 16)


def frames_of_a_hand(moves_from=8, colors=6, step_px=3):
    """Frames with things alone, then with a hand beside them, of so many colours, that moves."""
    for seq in range(20):
        tips = hand_blobs(400, 400 - step_px * max(seq - moves_from, 0))[:colors]
        own = [[thing] for thing in THINGS]
        if seq > 0:
            own[:colors] = [[tip, thing] for tip, thing in zip(tips, THINGS[:colors], strict=True)]
        yield seq, own, tips


@pytest.mark.parametrize("step_px", [3, 25])
def test_a_hand_that_moves_is_told_from_things_that_were_taken_for_it(step_px):
    """From the first frame on: nothing of what was taken moves."""
    identity, mistaken = MarkerIdentity(COLORS, 40), []
    for seq, blobs, tips in frames_of_a_hand(step_px=step_px):
        found = associated(identity, blobs, seq)
        mistaken += [seq] if identity.mistaken else []
        assert found == (tips if mistaken else THINGS)
    assert len(mistaken) == 1


def test_colours_that_did_not_show_where_the_hand_is_are_looked_for_anew():
    """The thing that was the wrist is none in that frame, and is no likelier than any other."""
    identity, mistaken = MarkerIdentity(COLORS, 40), []
    for seq, blobs, tips in frames_of_a_hand(colors=5):
        found = associated(identity, blobs, seq)
        if identity.mistaken:
            mistaken.append(seq)
            assert found == [*tips, None]
            assert identity.predicted(5, START_NS + seq * FRAME_NS) is None
        elif not mistaken:
            assert found == THINGS
    assert len(mistaken) == 1


def test_a_hand_that_rests_is_not_given_up_for_two_things_that_move():
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(30):
        tips = hand_blobs(300, 300)
        movers = [square_blob(color, 500, 60 + 60 * color + 4 * seq) for color in (1, 2)]
        blobs = [[tip, *(one for one in movers if one.color == tip.color)] for tip in tips]
        assert associated(identity, blobs, seq) == tips
        assert not identity.mistaken


def test_while_nothing_that_was_taken_for_a_hand_moves_all_is_looked_at():
    """Only a look at the whole of several pictures shows that something else does."""
    identity = MarkerIdentity(COLORS, 40)
    associated(identity, [[thing] for thing in THINGS], 0)
    for seq in range(1, 4):
        others = hand_blobs(400, 250)
        associated(identity, [list(pair) for pair in zip(THINGS, others, strict=True)], seq)
    assert identity.may_be_elsewhere
    associated(identity, [[thing] for thing in THINGS], 4)
    assert not identity.may_be_elsewhere


def test_a_hand_that_moves_beside_things_is_no_reason_to_look_at_all():
    identity = MarkerIdentity(COLORS, 40)
    for seq in range(6):
        tips = hand_blobs(300 + 8 * seq, 250)
        blobs = [[tip] for tip in tips] if not seq else list(zip(tips, THINGS, strict=True))
        associated(identity, [list(own) for own in blobs], seq)
    assert not identity.may_be_elsewhere
