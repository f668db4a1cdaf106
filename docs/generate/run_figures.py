"""`make figures`: run the benchmarks, and write what they measured to docs/figures/*.json.

`python -m docs.generate.run_figures [--short] [NAME ...]` runs some of them; --short runs their
shortest forms, which show that everything works and are not to be quoted. The pages are rendered
afterwards, by `make docs`.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from docs.generate.figures import FOLDER

ROOT = Path(__file__).parents[2]
# An absolute path in a message; only its last part belongs into a page.
_PATH = re.compile(r"(?<![\w.])(?:/[\w.+-]+)+/")


class Run(NamedTuple):
    """One file of figures: what makes it, with which options, and with which for a short run."""

    program: str
    options: str
    # None: it is short as it is.
    short: str | None
    # Of the full run, on two x86 cores with nothing beside it.
    minutes: float

    def command(self, short: bool) -> str:
        """The command line."""
        options = self.short if short and self.short is not None else self.options
        return f"{self.program} {options}".strip()


def _script(name: str, options: str, short: str | None, minutes: float) -> Run:
    return Run(f"python benchmarks/{name}.py", options, short, minutes)


RUNS = {
    "accuracy": _script("accuracy", "", "--seconds 2 --seeds 1", 3),
    "accuracy_other_seeds": _script("accuracy", "--seeds 5,6,7,8", "--seconds 2 --seeds 5", 3),
    "bus": _script("bus", "", None, 0.1),
    "calibrate_hand": _script("calibrate_hand", "", "--hands 1", 0.5),
    "calibrate_stereo": _script("calibrate_stereo", "", None, 0.1),
    "demo": Run(
        "rhot demo", "--no-viewer --json --seconds 30", "--no-viewer --json --seconds 3", 1
    ),
    "cut_markers": _script("cut_markers", "", "--recipes 1", 2.5),
    "distances": _script("distances", "", "--frames 2 --seeds 1", 5),
    "dots": _script("dots", "", "--clips 1", 60),
    "dots_pictures": _script(
        "dots_pictures", "", "--dots 8 --clips 1 --motion pinch --hindsight", 45
    ),
    "duplicate_frames": _script("duplicate_frames", "", "--clips 1", 8),
    "exposures": _script("exposures", "", None, 2),
    "filters": _script("filters", "", "--quick", 1),
    "footprint": _script("footprint", "", "--runs 1 --seconds 1", 0.7),
    "frame_rates": _script("frame_rates", "", None, 1),
    "grasp_metrology": _script("grasp_metrology", "", "--seeds 1", 0.5),
    "grasp_study": _script("grasp_study", "", "--people 1 --cycles 1", 3),
    "hard": _script("hard", "--seeds 2", "--frames 8 --seeds 1", 8),
    "hard_other_rooms": _script(
        "hard",
        "--first-seed 21 --seeds 3 --frames 3000",
        "--first-seed 21 --seeds 3 --frames 24",
        6,
    ),
    "held_out": _script("held_out", "", "--family skin", 8),
    "hindsight": _script("hindsight", "", "--part postures", 2),
    "latency": _script("latency", "", "--seconds 2 --rates 60", 2.5),
    "objects_grasp_pictures": _script("objects_grasp_pictures", "", "--hands 1 --passes 1", 13),
    "objects_pictures": _script("objects_pictures", "", "--seeds 1", 5),
    "objects_registration": _script("objects_registration", "", "--seeds 2", 2),
    "objects_tracking": _script("objects_tracking", "", "--seconds 2", 0.7),
    "picture": _script("picture", "", "--seconds 2 --seeds 1", 2),
    "proposed_colors": _script("proposed_colors", "", "--rooms 1", 8),
    "returns": _script("returns", "", None, 0.5),
    "rooms": _script("rooms", "", "--rooms 1", 6),
    "scale": _script(
        "scale", "--rigs 1 4 16 32 64", "--rigs 1 --fps 30 --routers 1 --seconds 2", 8
    ),
    "scenes": _script("scenes", "", "--seconds 1", 9),
    "solver": _script("solver", "", "--quick", 1.5),
    "solver_markers": _script("solver_markers", "", None, 0.6),
    "tilted_cameras": _script("tilted_cameras", "", None, 2),
    "tracker": _script("tracker", "", "--frames 90", 1),
    "tracker_compiled": _script("tracker_compiled", "", "--frames 90", 0.3),
    "unmeasured_posture": _script("unmeasured_posture", "", None, 0.1),
    "video_sync": _script("video_sync", "--seeds 1", "--only clean --seeds 1", 6),
}


def measure(name: str, short: bool) -> dict[str, Any]:
    """Run one, and what its file is to hold."""
    command, begun_s = RUNS[name].command(short), time.monotonic()
    figures = _output(shlex.split(command))
    return {
        "command": command,
        "date": datetime.date.today().isoformat(),  # noqa: DTZ011 - the day here
        "machine": f"{os.cpu_count()} cores, {platform.machine()}",
        "software": software(),
        "seconds": round(time.monotonic() - begun_s),
        "short": short and RUNS[name].short is not None,
        "figures": tidy(figures),
    }


def _output(words: list[str]) -> Any:
    """What a command writes to its --json FILE, or `rhot` to standard output."""
    program, *rest = words
    # The programs of this environment, whatever is first on the PATH.
    here = Path(sys.executable)
    programs = {"python": str(here), "rhot": str(here.with_name("rhot"))}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "figures.json"
        told = [] if "--json" in rest else ["--json", str(path)]
        out = subprocess.run(
            [programs[program], *rest, *told], cwd=ROOT, check=True, stdout=subprocess.PIPE
        ).stdout
        return json.loads(path.read_bytes() if told else out)


def tidy(value: Any) -> Any:
    """Figures with six digits, and texts without this machine's folders."""
    match value:
        case dict():
            return {key: tidy(inner) for key, inner in value.items()}
        case list():
            return [tidy(inner) for inner in value]
        case float():
            return float(f"{value:.6g}")
        case str():
            return _PATH.sub("", value)
    return value


def software() -> str:
    """What the figures were measured with."""
    packages = ("numpy", "scipy", "numba", "opencv-python-headless")
    names = [
        f"Python {platform.python_version()}",
        *(f"{name} {version(name)}" for name in packages),
    ]
    return ", ".join(names)


def main() -> int:
    """Run, write, and say how long each took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(RUNS)}; default: all")
    parser.add_argument("--short", action="store_true", help="the shortest forms")
    options = parser.parse_args()
    if unknown := set(options.names) - set(RUNS):
        parser.error(
            f"no figures are called {', '.join(sorted(unknown))}; there are {', '.join(RUNS)}"
        )
    FOLDER.mkdir(exist_ok=True)
    for name in options.names or RUNS:
        about = "" if options.short else f" (about {RUNS[name].minutes:g} minutes)"
        print(f"{name}: {RUNS[name].command(options.short)}{about}", flush=True)
        found = measure(name, options.short)
        text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
        (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")
        print(f"  {found['seconds']} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
