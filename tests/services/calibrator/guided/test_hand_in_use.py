"""What is said of a hand that is measured while it is used: what is known, what is missing, and
whether it may be saved.
"""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.hand import BASIC_LANDMARKS, DIGITS, default_hand
from rhot.messages import HandPoint, HandPoints
from services.calibrator.guided.hand_in_use import InUse, in_use_found, told
from services.calibrator.hand.free_motion.seen_so_far import SeenSoFar
from services.calibrator.hand.lengths import Length
from services.calibrator.output.hand_file import HandFile

_BONES = ("metacarpal", "proximal", "middle", "distal")
_TABLE = default_hand("right")


def made(sigma_m: float = 3e-3, **changes: object) -> HandFile:
    """A hand as a minute of free motion gives it; sigma_m is of the index finger's bones."""
    lengths = [
        Length(name=name, table_m=0.04, estimate_m=0.04, sigma_m=sigma, source="partly")
        for digit in DIGITS
        for name, sigma in (
            *((f"{digit} {bone}", 2.5e-3) for bone in _BONES),
            (f"{digit}, root to paint", 9e-3),
        )
    ]
    lengths[5:9] = [msgspec.structs.replace(one, sigma_m=sigma_m) for one in lengths[5:9]]
    fields = {name: getattr(_TABLE, name) for name in _TABLE.__struct_fields__}
    knuckles = dict.fromkeys(DIGITS[1:], 4e-3)
    told = {"seconds": 61.0, "residual_m": 6e-4, "size": 0.95, "knuckle_sigma_m": knuckles}
    return HandFile(**fields | told | {"lengths": lengths} | changes)


def used(seconds: float, held: tuple[str, ...] = (), missing: str = "") -> SeenSoFar:
    """A hand whose fingers came nearer to the wrist once a second, but for those that are held."""
    seen = SeenSoFar()
    for frame in range(round(30 * seconds) + 1):
        bent_m = 0.03 * (1.0 - np.cos(2.0 * np.pi * frame / 30.0))
        reach_m = {f"{digit}_tip": 0.17 - bent_m * (digit not in held) for digit in DIGITS}
        points = [
            HandPoint(
                name=name,
                position_m=(0.0, reach_m.get(name, 0.0), 0.5),
                sigma_m=(1e-3,) * 3,
                source="measured",
                cameras=["left", "right"],
            )
            for name in BASIC_LANDMARKS
            if name != missing
        ]
        stamp_ns = 10**18 + round(1e9 * frame / 30.0)
        seen.add(HandPoints(hand="right", seq=frame, stamp_ns=stamp_ns, points=points))
    return seen


def test_a_good_hand_says_how_well_each_finger_is_known() -> None:
    now = InUse(used(61.0), 0.0, 3, made(), "")
    found = in_use_found(now, "right")
    assert found.good
    assert found.advice == []
    figures = {one.name: one.value for one in found.figures}
    assert figures["bones of the index finger"] == "± 3.0 mm"
    assert figures["bones of the thumb"] == "± 2.5 mm"
    assert list(found.files) == ["hand.right.json"]
    said = told(now, "right")
    assert said.progress == 1.0
    assert "press Save" in said.to_do
    # Whose hand is at the mouse to press it.
    assert "press Save" in told(now._replace(silent_s=20.0), "right").to_do


def test_what_is_missing_is_asked_for_and_keeps_it_from_being_saved() -> None:
    cases = {
        "Bend the ring finger": made(not_bent=["ring"]),
        "seen whole for 31 s, 60 s are needed": made(seconds=31.0),
        "does not fit its paint": made(residual_m=3e-3),
        "bones of the index finger are known to 4.6 mm only": made(sigma_m=4.6e-3),
    }
    for reason, hand in cases.items():
        found = in_use_found(InUse(used(61.0), 0.0, 3, hand, ""), "right")
        assert not found.good
        assert found.only_good
        assert reason in found.advice[0]


def test_the_next_motion_follows_from_what_was_seen_and_not_from_the_last_estimate() -> None:
    seen = used(20.0, held=("middle", "ring", "little"))
    said = told(InUse(seen, 0.0, 0, None, ""), "right")
    assert said.to_do == "Bend the middle, ring and little fingers, and stretch again."
    assert said.seen == ["seen whole for 20 s of 60 s"]
    found = in_use_found(InUse(seen, 0.0, 0, None, ""), "right")
    figures = {one.name: one.value for one in found.figures}
    assert figures["bones of the index finger"] == "not known yet"
    assert figures["bones of the ring finger"] == "not bent yet"
    assert not found.good
    # Bent since the estimate was made.
    now = InUse(used(61.0), 0.0, 1, made(not_bent=["ring"]), "")
    assert "being measured" in told(now, "right").to_do
    uncertain = InUse(used(61.0), 0.0, 1, made(sigma_m=4.6e-3), "")
    assert "stretch and bend it" in told(uncertain, "right").to_do


def test_progress_grows_with_time_with_bent_fingers_and_with_what_is_known() -> None:
    steps = [
        InUse(SeenSoFar(), 0.0, 0, None, ""),
        InUse(used(10.0, held=("ring",)), 0.0, 0, None, ""),
        InUse(used(10.0), 0.0, 0, None, ""),
        InUse(used(40.0), 0.0, 0, None, ""),
        InUse(used(40.0), 0.0, 1, made(sigma_m=5e-3), ""),
        InUse(used(40.0), 0.0, 2, made(), ""),
    ]
    progress = [told(one, "right").progress for one in steps]
    assert progress == sorted(set(progress))
    assert 0.0 <= progress[0] < progress[-1] < 1.0


def test_who_is_not_seen_is_told() -> None:
    never = told(InUse(SeenSoFar(), 6.0, 0, None, ""), "left")
    assert "left hand is not seen" in never.to_do
    assert "is fusion running" in never.to_do
    gone = told(InUse(used(3.0), 6.0, 0, None, ""), "right")
    assert "is not seen" in gone.to_do
    assert "fusion" not in gone.to_do
    covered = used(3.0, missing="index_tip")
    assert covered.seconds == 0.0
    assert "not seen now: index tip" in told(InUse(covered, 0.1, 0, None, ""), "right").seen
