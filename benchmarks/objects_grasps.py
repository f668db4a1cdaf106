"""Who touches and who holds a cup: begins and ends against the truth, beside a fixed threshold.

    python benchmarks/objects_grasps.py --hands 20 --json objects_grasps.json
    python benchmarks/objects_grasps.py --captures FOLDER...

Synthetic (testing/synthetic_grasps.py): hands of many sizes, left and right, close on cups, carry
them and put them back; their landmarks' noise is as rendered hands show it, and the solver solves
them. As many hands pass 10 mm beside a cup. Constants were chosen on seeds below 1000; the default
is those above. With --captures FOLDER... it scores folders that `rhot simulate` and `rhot track`
made of rendered pictures: CAPTURE and its result in CAPTURE/result.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rhot.files.capture import read_lines
from rhot.geometry.solids import Solid
from rhot.hand_skin import PARTS
from rhot.messages.objects import Contact, ObjectContacts, ObjectPose
from rhot.messages.simulator import Truth
from rhot.object_motion import ObjectHistory
from services.cli.evaluate.contacts.contact_score import (
    ContactScore,
    contact_score,
    touch_errors,
    within_share,
)
from services.object_tracker.contacts.distances import part_distances, seen_hand
from services.object_tracker.contacts.step import ContactStep
from testing.synthetic_grasps import GraspScene, Recording, Setting, record

# Below it constants were chosen, from it on they are judged.
JUDGED_FROM = 1000
_GAP_M = 0.01
# What a plain method would do: touch below 2 mm, until above 3 mm.
_PLAIN_ON_M, _PLAIN_OFF_M = 0.002, 0.003
# The cup's poses come later than the hand's: a frame of a bridge's own.
_DELAY_NS = 10_000_000


class Run(NamedTuple):
    """One recording, and what was made of it."""

    truth: list[Truth]
    messages: list[ObjectContacts]


def measure(hands: int = 20, first_seed: int = JUDGED_FROM) -> dict[str, float]:
    """The figures of that many hands and cups, and as many that pass."""
    figures: dict[str, float] = {}
    grasps = [_recorded(setting) for setting in _settings(hands, first_seed, 0.0)]
    passes = [_recorded(setting) for setting in _settings(hands, first_seed, _GAP_M)]
    for name, method in (("", contacts), ("plain_", plain_contacts)):
        runs = [Run(r.truth, method(r, scene.solid)) for scene, r in grasps]
        figures |= {f"{name}{key}": value for key, value in figures_of(runs).items()}
        beside = [Run(r.truth, method(r, scene.solid)) for scene, r in passes]
        figures[f"{name}events_beside"] = sum(event_count(run) for run in beside)
    return figures


def figures_of(runs: Sequence[Run]) -> dict[str, float]:
    """Shares and errors of several recordings together."""
    scores = [score for run in runs if (score := contact_score(run.truth, run.messages, "cup"))]
    each = [touch_errors(run.truth, run.messages, "cup") for run in runs]
    true = sum(count for _, count in each)
    shares = [within_share(errors, count) * count for errors, count in each]
    begins = np.concatenate([errors.begin for errors, _ in each])
    ends = np.concatenate([errors.end for errors, _ in each])
    return {
        "touches": true,
        "within_share": round(sum(shares) / max(true, 1), 4),
        "begin_ms_p95": _tail(begins[:, 0]),
        "end_ms_p95": _tail(ends[:, 0]),
        "begin_mm_p95": _tail(begins[:, 1]),
        "end_mm_p95": _tail(ends[:, 1]),
        "touches_missed": sum(errors.missed for errors, _ in each),
        "touches_false": sum(errors.false for errors, _ in each),
        "recordings": len(scores),
        "grasps_right": sum(_grasps_right(score) for score in scores),
        "told_late_ms": _told_late_ms(runs),
    }


def contacts(recording: Recording, solid: Solid) -> list[ObjectContacts]:
    """As the object tracker makes them, the cup's poses a little late."""
    step, messages = ContactStep({"cup": solid}), []
    for pose in recording.merged(_DELAY_NS):
        if isinstance(pose, ObjectPose):
            step.note(pose)
        else:
            messages += step.step(pose)
    return messages


def plain_contacts(recording: Recording, solid: Solid) -> list[ObjectContacts]:
    """Fixed thresholds on each distance; no grasps."""
    history, messages = ObjectHistory(), []
    since_ns, until_ns = dict.fromkeys(PARTS, 0), dict.fromkeys(PARTS, 0)
    for pose in recording.merged(_DELAY_NS):
        if isinstance(pose, ObjectPose):
            history.add(pose)
            continue
        cup = history.at(pose.stamp_ns)
        if cup is None:
            continue
        told = []
        for one in part_distances(seen_hand(pose), cup, solid):
            if not since_ns[one.part] and one.distance_m < _PLAIN_ON_M:
                since_ns[one.part] = pose.stamp_ns
            elif since_ns[one.part] and one.distance_m > _PLAIN_OFF_M:
                since_ns[one.part], until_ns[one.part] = 0, pose.stamp_ns
            told.append(
                Contact(
                    hand=pose.hand,
                    part=one.part,
                    distance_m=one.distance_m,
                    sigma_m=one.sigma_m,
                    point_m=tuple(one.point_m.tolist()),
                    touching=since_ns[one.part] > 0,
                    since_ns=since_ns[one.part],
                    until_ns=until_ns[one.part],
                )
            )
        messages.append(
            ObjectContacts(
                object="cup", seq=len(messages), stamp_ns=pose.stamp_ns, contacts=told, grasps=[]
            )
        )
    return messages


def captured(folder: Path) -> Run:
    """A capture and the result in it, of rendered pictures."""
    truth = list(read_lines(folder / "truth.jsonl", Truth))
    return Run(truth, list(read_lines(folder / "result" / "contacts.jsonl", ObjectContacts)))


def _settings(count: int, first_seed: int, gap_m: float) -> list[Setting]:
    """Hands of all sizes and cups of many, from the first seed on."""
    found: list[Setting] = []
    for seed in range(first_seed, first_seed + 20 * count):
        rng = np.random.default_rng(seed)
        setting = Setting(
            seed=seed,
            hand="right" if seed % 2 else "left",
            scale=float(rng.uniform(0.85, 1.1)),
            diameter_m=float(rng.uniform(0.055, 0.085)),
            height_m=float(rng.uniform(0.08, 0.12)),
            gap_m=gap_m,
        )
        try:
            GraspScene(setting)
        except ValueError:
            continue  # a small hand cannot hold every cup
        found.append(setting)
        if len(found) == count:
            break
    return found


def _recorded(setting: Setting) -> tuple[GraspScene, Recording]:
    scene = GraspScene(setting)
    return scene, record(scene)


def _grasps_right(score: ContactScore) -> int:
    """1 if a recording's grasps are all found, and no other."""
    return int(score.grasps.missed == 0 and score.grasps.false == 0 and score.grasps.true > 0)


def event_count(run: Run) -> int:
    """Touches and grasps that began in a recording without any."""
    begun = {
        (one.hand, one.part, one.since_ns)
        for message in run.messages
        for one in message.contacts
        if one.touching
    }
    return len(begun) + len({one.since_ns for message in run.messages for one in message.grasps})


def _told_late_ms(runs: Sequence[Run]) -> float:
    """Median of how long after it happened the first message tells of a touch's begin."""
    first: dict[tuple[int, str, int], int] = {}
    for n, run in enumerate(runs):
        for message in run.messages:
            for one in message.contacts:
                if one.touching:
                    first.setdefault((n, one.part, one.since_ns), message.stamp_ns)
    late = [(at_ns - key[2]) * 1e-6 for key, at_ns in first.items()]
    return round(float(np.median(late)), 1) if late else 0.0


def _tail(errors: np.ndarray) -> float:
    return round(float(np.percentile(np.abs(errors), 95.0)), 2) if len(errors) else 0.0


def print_table(title: str, figures: dict[str, float], show: Callable[[str], None] = print) -> None:
    show(title)
    for key, value in figures.items():
        show(f"  {key:22}{value:>10g}")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hands", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=JUDGED_FROM)
    parser.add_argument("--captures", type=Path, nargs="+", help="score these captures instead")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    if options.captures:
        figures = figures_of([captured(folder) for folder in options.captures])
        figures = {f"rendered_{key}": value for key, value in figures.items()}
    else:
        figures = measure(options.hands, options.first_seed)
    print_table("rendered" if options.captures else "synthetic", figures)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
