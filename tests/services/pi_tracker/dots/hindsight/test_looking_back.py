"""Dots of a recording, named with hindsight: what live was told wrongly is put right."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot.hand import DIGITS
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.dot import Dot, Patch, SeenPatches
from services.pi_tracker.dots.hindsight.looking_back import LOOKS, look_back
from services.pi_tracker.dots.search import Search
from services.pi_tracker.dots.tracker import DotTracker
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from testing.dot_patches import NAMES, REST, SIZE, patches_at, patches_of
from testing.synthetic_dots import DotFrame, dot_frames, scene_of


def _begin(search: Search) -> DotTracker:
    return DotTracker(NAMES, SIZE, None, search, remembers=True)


def test_every_picture_has_its_dots_from_the_first_that_shows_them() -> None:
    moving = [REST + np.array([3.0, 1.0]) * k for k in range(12)]
    pictures = [SeenPatches(0.0, patches_at(REST[:5])), SeenPatches(1 / 30, [])]
    pictures += [SeenPatches((k + 2) / 30, patches_at(p)) for k, p in enumerate(moving)]
    pictures[7] = SeenPatches(7 / 30, patches_at(np.delete(moving[5], 6, axis=0)))
    looks = []
    told = look_back(_begin, pictures, lambda: looks.append(1))
    assert len(looks) == LOOKS * len(pictures)
    assert [len(one) for one in told] == [0, 0, 8, 8, 8, 8, 8, 7, 8, 8, 8, 8, 8, 8]
    assert "index_distal" not in told[7]
    for dots, truth in zip(told[2:], moving, strict=True):
        for name, dot in dots.items():
            x, y = truth[NAMES.index(name)]
            assert (dot.x_px, dot.y_px, dot.state) == (x, y, "seen")


def test_nothing_that_starts_is_no_error() -> None:
    pictures = [SeenPatches(k / 30, patches_at(REST[:3])) for k in range(4)]
    assert look_back(_begin, pictures) == [{}, {}, {}, {}]
    assert look_back(_begin, []) == []


def test_dots_that_share_a_patch_are_told_so_and_less_surely() -> None:
    still = [patches_at(REST) for _ in range(8)]
    touching = REST.copy()
    touching[3] = touching[7] = (640.0, 330.0)
    steps = np.linspace(0.0, 1.0, 8)
    coming = [patches_at(REST + s * (touching - REST)) for s in steps[:-1]]
    merged = [Patch(640.0, 330.0, 520.0), *patches_at(np.delete(touching, [3, 7], axis=0))]
    seen = [*still, *coming, merged, merged]
    told = look_back(_begin, [SeenPatches(k / 30, own) for k, own in enumerate(seen)])
    tips = [told[-1][name] for name in ("thumb_tip", "index_tip")]
    assert [(tip.state, tip.patch) for tip in tips] == [("merged", 0), ("merged", 0)]
    assert all(tip.sigma_px > 5.0 and tip.quality < 0.5 for tip in tips)


def _exchanged(told: list[dict[str, Dot]], frames: list[DotFrame]) -> int:
    """How many visible dots have the name of another one."""
    wrong = 0
    for dots, frame in zip(told, frames, strict=True):
        near = max(10.0, 1.3 * frame.radius)
        for k, name in enumerate(NAMES):
            if name in dots and dots[name].state != "carried" and frame.visible[k] > 0.35:
                apart = np.linalg.norm(frame.places - (dots[name].x_px, dots[name].y_px), axis=1)
                wrong += bool(apart[k] > near and apart.min() <= near)
    return wrong


def test_names_that_were_exchanged_for_long_are_put_right(rhot_data: Path) -> None:
    """A hand that grasps, recorded, seen from a side where live half of the names are wrong."""
    recorded = load_recording(rhot_data / "hand_motion" / "leap" / "grab.csv")
    assert isinstance(recorded, RecordedJoints)
    dots = tuple((digit, joint) for digit in (0, 1) for joint in range(4))
    assert [finger_landmarks(DIGITS[digit])[joint] for digit, joint in dots] == list(NAMES)
    frames = dot_frames(scene_of(recorded, dots, SIZE, 30.0, 35), 25)[:100]
    clicks = frames[0].places + np.random.default_rng(1).normal(0.0, 2.0, (8, 2))
    seeds = {name: (float(x), float(y)) for name, (x, y) in zip(NAMES, clicks, strict=True)}
    tracker = DotTracker(NAMES, SIZE, seeds)
    live, pictures = [], []
    for k, frame in enumerate(frames):
        pictures.append(SeenPatches(k / 30, patches_of(frame, tracker.dot_area_px2)))
        live.append(tracker.step(pictures[-1].patches, k / 30))
    told = look_back(lambda s: DotTracker(NAMES, SIZE, seeds, s, remembers=True), pictures)
    assert _exchanged(live, frames) > 300
    assert _exchanged(told, frames) < 20
