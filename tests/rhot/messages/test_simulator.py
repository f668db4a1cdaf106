"""The simulator's truth: old recordings decode, parts have their names."""

from __future__ import annotations

import msgspec
import pytest

from rhot.messages.simulator import ObjectTruth

OLD = b'{"position_m":[0,0,0.5],"orientation_wxyz":[1,0,0,0]}'


def test_truth_without_contacts_decodes():
    truth = msgspec.json.decode(OLD, type=ObjectTruth)
    assert (truth.contacts, truth.held_by) == ({}, "")


def test_contacts_and_who_holds_travel():
    truth = ObjectTruth(
        position_m=(0.0, 0.0, 0.5),
        orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
        contacts={"right.thumb": -0.0002, "left.palm": 0.3},
        held_by="right",
    )
    assert msgspec.json.decode(msgspec.json.encode(truth), type=ObjectTruth) == truth


@pytest.mark.parametrize("part", ["thumb", "right.thumb_tip", "third.palm"])
def test_only_parts_of_hands_have_contacts(part):
    text = OLD[:-1] + f',"contacts":{{"{part}":0.1}}}}'.encode()
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(text, type=ObjectTruth)
