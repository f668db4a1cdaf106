"""From pictures to joints, scene by scene: `python benchmarks/scenes.py [--seconds S] [--seed N]
[--scenes A,B] [--json FILE]`.

Each scene goes through the commands a user has: `rhot simulate`, `rhot track`, `rhot score`. Of the
right hand, in degrees and mm: orientation_rms_deg and orientation_max_deg of the wrist, the mean
size of the errors of all joint angles (angles_mean_deg) and of the fingers' MCP and PIP joints,
the RMS of the finger tips (tips_rms_mm), the share of instants without a pose (missed_share), and
`mean` over the scenes.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

SCENES = ("fist", "pinch", "grab", "piano", "still", "wave", "random", "hard", "two_hands")
FINGERS = ("index", "middle", "ring", "little")


def rhot(*words: str) -> bytes:
    """Run a command of rhot; what it printed."""
    command = [sys.executable, "-m", "services.cli", *words]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout


def score(scene: str, seconds: float, seed: int) -> dict[str, float]:
    """The figures of one scene."""
    with tempfile.TemporaryDirectory() as folder:
        capture, result = f"{folder}/capture", f"{folder}/result"
        given = ("--seconds", str(seconds), "--seed", str(seed))
        rhot("simulate", scene, *given, "--out", capture)
        rhot("track", capture, "--out", result)
        hand = json.loads(rhot("score", capture, result, "--json"))["hands"]["right"]
    return {
        "orientation_rms_deg": hand["orientation"]["rms_deg"],
        "orientation_max_deg": hand["orientation"]["max_deg"],
        "mcp_mean_deg": mean_angle(hand, "mcp"),
        "pip_mean_deg": mean_angle(hand, "pip"),
        "angles_mean_deg": hand["angles_mean_deg"],
        "tips_rms_mm": hand["tips_rms_mm"],
        "missed_share": hand["coverage"]["missed_share"],
    }


def mean_angle(hand: dict[str, Any], joint: str) -> float:
    """Mean error of one joint of the four fingers, deg."""
    return statistics.mean(hand["angles"][finger][joint]["mean_deg"] for finger in FINGERS)


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0, help="of each scene")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    found: dict[str, dict[str, float]] = {}
    for scene in options.scenes.split(","):
        found[scene] = score(scene, options.seconds, options.seed)
        print(scene, *(f"{name} {value:.2f}" for name, value in found[scene].items()), flush=True)
    found["mean"] = {
        name: statistics.mean(figures[name] for figures in found.values())
        for name in next(iter(found.values()))
    }
    print("mean", *(f"{name} {value:.2f}" for name, value in found["mean"].items()))
    if options.json:
        rounded = {
            scene: {name: round(value, 4) for name, value in figures.items()}
            for scene, figures in found.items()
        }
        options.json.write_text(json.dumps(rounded, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
