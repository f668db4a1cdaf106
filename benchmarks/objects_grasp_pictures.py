"""Touches and grasps from rendered pictures: `benchmarks/objects_grasp_pictures.py [--json FILE]`

Hands and cups of the simulator's grasp family (services/simulator/scene/grasp_scenes.py), held-out
seeds: the odd ones. Each takes its cup, carries it and puts it back, and another time closes 10 mm
beside it. Rendered, tracked by `rhot track` (the Pis' detector, fusion, solver, contacts), and
compared with the truth as benchmarks/objects_grasps.py does.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from objects_grasps import Run, captured, event_count, figures_of, print_table

from rhot.files.config import load_rig
from services.cli.defaults import sim_toml

# One grasp: it comes, takes, carries, puts back, opens and leaves in 8 s.
SECONDS, HANDS = 8.5, 20
_RENDER = """
import sys
from pathlib import Path
from rhot.files.config import load_rig
from services.simulator.files.capture_writer import write_capture
from services.simulator.scene.grasp_scenes import grasp_scene
config, seed, touch, seconds, folder = sys.argv[1:]
scene = grasp_scene(load_rig(config), int(seed), touch=touch == "touch")
write_capture(scene, float(seconds), Path(folder))
"""


def recorded(folder: Path, job: tuple[int, str]) -> Run:
    """One recording of that seed, `touch` or `pass`, rendered and tracked in other processes."""
    seed, touch = job
    capture = folder / f"{touch}{seed}"
    render = [sys.executable, "-c", _RENDER, str(sim_toml()), str(seed), touch]
    subprocess.run([*render, str(SECONDS), str(capture)], check=True, capture_output=True)
    track = [sys.executable, "-m", "services.cli", "track", str(capture), "--no-progress"]
    out = ["--out", str(capture / "result")]
    subprocess.run([*track, *out], check=True, capture_output=True)
    return captured(capture)


def measure(hands: int = HANDS, passes: int = HANDS, processes: int = 2) -> dict[str, float]:
    """The figures of that many hands and cups, and of as many that pass beside."""
    load_rig(sim_toml())
    jobs = [(2 * n + 1, "touch") for n in range(hands)]
    jobs += [(2 * n + 1, "pass") for n in range(passes)]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(processes) as pool:
        runs = list(pool.map(partial(recorded, Path(folder)), jobs))
    figures = figures_of(runs[:hands]) if hands else {}
    if passes:
        figures["passing_hands"] = passes
        figures["events_beside"] = sum(map(event_count, runs[hands:]))
    return {f"rendered_{key}": value for key, value in figures.items()}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hands", type=int, default=HANDS)
    parser.add_argument("--passes", type=int, default=HANDS)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    figures = measure(options.hands, options.passes, options.processes)
    print_table("rendered", figures)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
