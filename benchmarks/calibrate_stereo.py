"""`rhot calibrate stereo` on 13 real pairs of pictures of a chessboard ($RHOT_DATA, folder
stereo_chessboard): `python benchmarks/calibrate_stereo.py [--json FILE]`.

The side of a square is not known, so it counts as 1: errors are in squares, percent and pixels. The
held-out figures are of each position of the board, triangulated by the calibration from the others.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
FIGURES = (
    "stereo_rms_px",
    "held_out_squares",
    "held_out_px",
    "square_error_percent",
    "square_worst_percent",
    "epipolar_px",
)


def calibrate(pictures: Path) -> dict[str, float]:
    """What the command says of these pictures."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["calibrate", "stereo", str(pictures), "--square", "1", "--out", folder, "--json"]
        command = [sys.executable, "-m", "services.cli", *words]
        result = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    figures = {name: result["residuals"][name] for name in FIGURES}
    return figures | {"positions": result["inputs"]["positions"]}


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    pictures = DATA / "stereo_chessboard"
    if not pictures.is_dir():
        print(f"no {pictures}; set RHOT_DATA to the folder of real recordings", file=sys.stderr)
        return 1
    figures = calibrate(pictures)
    for name, value in figures.items():
        print(f"{name:22s} {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
