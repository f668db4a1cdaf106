"""Whether `rhot calibrate colors --auto` finds the paint in rooms that nobody arranged.

    python benchmarks/proposed_colors.py [--tuning] [--rooms N] [--json FILE]

Rooms by number (testing/families/rooms.py; --tuning: those that constants may be chosen on): things
in the paints' colours, any lamp, both cameras, three seconds of a hand that moves. Colours are
proposed from as many pictures as the command takes out of a video, and from the first one of them,
which does not tell what moves (`one`: what stands out most, as nobody could know more). Then the
tracker goes through the clip with each, and with ranges as somebody has them who clicks on the
paint. 15 seconds a room.
    right    of six colours of a camera, those proposed where their paint is, in three of four boxes
    wrong    those proposed elsewhere; the rest is not proposed
    found    of markers of which 60 % or more are visible, the share that is told where its paint is
    astray   of markers that are told, the share that is on something else
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from rooms import ASTRAY_PX, VISIBLE, Count, asked, counted, figures_of

from rhot.files.calibration import Colors
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from services.cli.calibrate.colors import AUTO_FRAMES
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.proposal.propose import Proposal, boxes_of, for_markers, propose
from services.pi_tracker.identify.hand_layout import Landmarks
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.simulator.camera.frame_source import FrameSource
from testing.families.clicks import clicked_colors
from testing.families.pictures import PaintMiddles, frame_of, visible_shares
from testing.families.rooms import room
from testing.synthetic_points import START_NS

Wanted = Mapping[str, tuple[np.bool_, Array]]
WAYS = ("video", "one", "clicks")


@dataclass
class Tally:
    """Of one way to colours: of those wanted, how many are right and wrong, and its clips."""

    wanted: int = 0
    right: int = 0
    wrong: int = 0
    clips: list[Count] = field(default_factory=list)

    def note(self, found: Sequence[Proposal], seen: Sequence[Wanted]) -> None:
        """Count what was proposed for a camera."""
        right = sum(_is_right(one, seen) for one in found)
        self.wanted += len(seen[0])
        self.right += right
        self.wrong += len(found) - right

    def figures(self) -> dict[str, float]:
        """The keys of the JSON file."""
        shares = {"right": self.right, "wrong": self.wrong}
        told = {name: count / self.wanted for name, count in shares.items()} if self.wanted else {}
        return {**told, **figures_of(self.clips)}


def _is_right(proposal: Proposal, seen: Sequence[Wanted]) -> bool:
    """Whether three of four boxes are where the paint is."""
    hits = 0
    for box in proposal.boxes:
        middle = np.array([box.x_px + 0.5 * box.width_px, box.y_px + 0.5 * box.height_px])
        _, paint_px = seen[box.frame][proposal.color]
        hits += float(np.linalg.norm(middle - paint_px)) <= ASTRAY_PX
    return 4 * hits >= 3 * len(proposal.boxes)


def proposed(frames: Sequence[Frame], landmarks: Landmarks) -> tuple[list[Proposal], Colors]:
    """What is proposed of the colours of these landmarks, and the ranges that come of it."""
    wanted = list(landmarks)
    found, _ = for_markers(propose(frames, wanted, landmarks)[0], wanted)
    ranges = fit(gather(frames, boxes_of(found)).samples) if found else {}
    return found, Colors(date="", tool="benchmarks", colors=ranges)


def in_room(number: int, tallies: Mapping[str, Tally]) -> None:
    """Count both cameras of a room."""
    recipe = room(number)
    scene, hand = recipe.scene(), recipe.hand()
    landmarks = scene.hands[hand.hand].landmarks
    shares = visible_shares(recipe, scene)
    middles = PaintMiddles(scene, hand, tuple(landmarks))
    for name, camera in scene.cameras.items():
        source = FrameSource(scene, name, recorded=True)
        frames: list[Frame] = []
        seen: list[Wanted] = []
        for seq, visible in enumerate(shares[name] >= VISIBLE):
            taken = source.take(seq, START_NS)
            if taken.image is None:
                continue
            paint_px = camera.project(middles(np.array([taken.time_s]))[0])
            frames.append(frame_of(taken))
            entries = zip(visible, paint_px, strict=True)
            seen.append(dict(zip(landmarks.values(), entries, strict=True)))
        numbers = np.linspace(0, len(frames) - 1, AUTO_FRAMES).astype(int).tolist()
        colors = {"clicks": clicked_colors(recipe, name)}
        for way, of in (("video", numbers), ("one", numbers[:1])):
            found, colors[way] = proposed([frames[n] for n in of], scene.config.landmarks)
            tallies[way].note(found, [seen[n] for n in of])
        for way in WAYS:
            count = tracked(scene.config, name, colors[way], frames, seen)
            tallies[way].clips.append(count)
            share = count.found / max(count.visible, 1)
            print(f"room {number:5} {name:6} {way:7}{share:7.1%} ({count.astray:3} astray)")


def tracked(
    config: RigConfig, name: str, colors: Colors, frames: Sequence[Frame], seen: Sequence[Wanted]
) -> Count:
    """A clip with these colours; nothing is told where one is missing, as rhot refuses that."""
    whole = set(seen[0]) <= set(colors.colors)
    tracker = step_of_rig(config, name, colors) if whole else None
    count = Count()
    for frame, wanted in zip(frames, seen, strict=True):
        markers = tracker.step(frame).markers if tracker else []
        count = counted(count, markers, wanted)
    return count


def main() -> None:
    """Print a table; with --json, write it too."""
    arguments = asked(__doc__)
    tallies = {way: Tally() for way in WAYS}
    for number in range(arguments.first, arguments.first + arguments.rooms):
        in_room(number, tallies)
    figures = {way: tally.figures() for way, tally in tallies.items()}
    keys = ("right", "wrong", "found", "astray", "whole", "median", "lowest")
    print(f"{'':8}" + "".join(f"{key:>9}" for key in keys))
    for way, row in figures.items():
        shown = (f"{row[key]:9.1%}" if key in row else f"{'':9}" for key in keys)
        print(f"{way:8}" + "".join(shown))
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
