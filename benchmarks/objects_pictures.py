"""Registration from rendered pictures: `python benchmarks/objects_pictures.py [--json FILE]`

A part of benchmarks/objects.py. The scene `registration` of the simulator (a tracker with a painted
bead, moved and turned) is rendered, tracked by the detector of the Pis, and registered with the
noise, outliers and lateness of benchmarks/objects_registration.py on the tracker's exact poses,
each recording with several draws of that noise.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from objects_registration import as_command

from rhot.files.calibration import load_objects, load_rig_cameras
from rhot.files.config import load_rig
from rhot.geometry.transforms import angle_between, apply, inverse
from rhot.messages import MarkerFrame
from rhot.messages.objects import OpenVrPose
from services.calibrator.objects.register import register
from services.calibrator.objects.sightings import sightings
from services.calibrator.objects.tracker_path import tracker_path
from services.cli.defaults import config_dir
from testing.synthetic_tracker import Lighthouse

SECONDS, SEEDS, DRAWS = 20.0, 3, 6
LIGHTHOUSES: dict[str, dict[str, Any]] = {
    "exact": {"noise_m": 0.0, "noise_rad": 0.0, "outliers": 0.0},
    "white": {},
    "lasting .5 s": {"correlation_s": 0.5},
}


def record(folder: Path, seed: int) -> tuple[Path, Path]:
    """Render and track; the folders of the capture and of what was tracked."""
    capture, tracked, rig = folder / "capture", folder / "tracked", folder / "config"
    shutil.copytree(config_dir(), rig)
    text = (rig / "sim.toml").read_text(encoding="utf-8")
    exact = "[simulator]\ntracker_noise_m = 0.0\ntracker_noise_deg = 0.0\n"
    (rig / "sim.toml").write_text(text.replace("[simulator]\n", exact), encoding="utf-8")
    rhot = [sys.executable, "-m", "services.cli"]
    told = ["--seconds", str(SECONDS), "--seed", str(seed), "--config", str(rig / "sim.toml")]
    told += ["--out", str(capture), "--no-progress"]
    subprocess.run([*rhot, "simulate", "registration", *told], check=True, capture_output=True)
    told = [str(capture), "--out", str(tracked), "--no-progress"]
    subprocess.run([*rhot, "track", *told], check=True, capture_output=True)
    return capture, tracked


def errors(capture: Path, tracked: Path, lighthouse: Lighthouse) -> dict[str, float]:
    """Errors of the registration of one recording."""
    rig = load_rig(capture / "rig.toml")
    table = next(one for one in rig.object if one.marker)
    lines = (tracked / "markers.jsonl").read_bytes().splitlines()
    frames = [msgspec.json.decode(line, type=MarkerFrame) for line in lines]
    lines = (capture / "objects.jsonl").read_bytes().splitlines()
    poses = [msgspec.json.decode(line, type=OpenVrPose) for line in lines]
    own = [pose for pose in poses if pose.device.serial == table.serial]
    seen = sightings(frames, load_rig_cameras(rig), str(table.marker))
    path = tracker_path(lighthouse.disturbed(own))
    found = register({table.serial: seen}, {table.serial: path})
    objects = load_objects(rig.calibration_dir)
    T = np.array(objects.T_rig_from_lighthouse)
    # The volume: where the tracker was.
    off = apply(found.T_rig_from_lighthouse, path.positions_m) - apply(T, path.positions_m)
    middle = np.array(found.middle_m)
    there = apply(T, apply(inverse(found.T_rig_from_lighthouse), middle))
    middle_mm = 1e3 * float(np.linalg.norm(there - middle))
    place, truth = found.trackers[table.serial], objects.objects[table.name].marker_m
    return {
        "mm": 1e3 * float(np.median(np.linalg.norm(off, axis=1))),
        "deg": float(np.degrees(angle_between(found.T_rig_from_lighthouse[:3, :3], T[:3, :3]))),
        "ms": abs(1e-6 * place.time_offset_ns - 1e3 * lighthouse.late_s),
        "marker_mm": 1e3 * float(np.linalg.norm(place.marker_m - np.array(truth))),
        "residual_px": found.residual.px,
        "held_out_px": found.held_out.px,
        # Of the shift in the middle of the volume, which sigma is of.
        "sigmas": middle_mm / (1e3 * found.sigma_m),
    }


def measure(seeds: int = SEEDS) -> dict[str, Any]:
    """All recordings; prints a table, and returns the figures."""
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in LIGHTHOUSES}
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            capture, tracked = record(Path(folder), seed)
            for name, noise in LIGHTHOUSES.items():
                for draw in range(1, 1 + (DRAWS if name != "exact" else 1)):
                    own = errors(capture, tracked, Lighthouse(seed=10 * seed + draw, **noise))
                    runs[name].append(own)
                    print(f"seed {seed}, {name:13s}", end="")
                    print("".join(f"  {key} {value:.3f}" for key, value in own.items()))
    figures: dict[str, Any] = {}
    for name, all_of in runs.items():
        word = "registration_pictures_" + name.split()[0]
        for key in ("mm", "deg", "ms", "sigmas"):
            values = [own[key] for own in all_of]
            figures[f"{word}_{key}"] = round(float(np.median(values)), 4)
            figures[f"{word}_{key}_max"] = round(max(values), 4)
    return figures


if __name__ == "__main__":
    sys.exit(as_command(__doc__, measure, SEEDS))
