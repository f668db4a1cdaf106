"""The text of a score has all its parts, and a dash for what was not measured."""

from __future__ import annotations

import msgspec

from services.cli.evaluate.score_math import score_hand
from services.cli.evaluate.score_table import score_text
from services.cli.evaluate.score_types import Coverage, ObjectScore, Score
from services.cli.evaluate.truth_track import hand_track


def test_a_score_has_all_its_parts(made_up):
    hand = score_hand(
        made_up.poses(shift_m=(0.0, 0.0, 0.003)),
        hand_track(made_up.truths(), "right"),
        made_up.model,
        1e9 / 30,
    )
    lost = ObjectScore(
        poses=3,
        scored=0,
        unregistered=3,
        position=None,
        orientation=None,
        coverage=Coverage(
            expected=10, missed=10, missed_share=1.0, longest_gap_ms=100.0, outside=0
        ),
        delay_ms=None,
    )
    text = score_text(
        Score(
            hands={"right": msgspec.structs.replace(hand, delay_ms=None)},
            objects={"cup": lost},
            notes=["so it is"],
        )
    )
    for part in ("thumb cmc", "3.00", "0 of 90 instants", "none", "note: so it is"):
        assert part in text
    rows = [line.split() for line in text.splitlines() if line.startswith("cup")]
    assert rows[0] == ["cup,", "mm", *"-" * 4]
    told = [" ".join(row) for row in rows[3:]]
    assert told[0] == "cup, ok 0.0 % 0 of 3 poses scored, 3 not registered"
    assert told[1].startswith("cup, dropouts 100.0 %")
    assert told[3] == "cup, delay - ms of the content"
    assert next(line for line in text.splitlines() if line.startswith("delay")).split()[1] == "-"
