"""How exact fusion is, how honest, and what it costs: `python benchmarks/accuracy.py [--rendered] [--json FILE]`.

From synthetic observations (services/fusion/synthetic.py): geometry, timing, 0.06 px of noise, so that errors are fusion's own. --rendered
adds hands as the simulator's cameras see them, through the tracker, against the landmarks of its truth: that includes what paint, skin,
light and the detector do (a minute or two). Errors are RMS, in mm; nees is squared error over predicted variance, 1 if sigma is honest.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path as File
from typing import Any

import msgspec
import numpy as np

from rhot.calibration import load_colors, load_hand
from rhot.config import Fusion, RigConfig, load_rig
from rhot.hand import BASIC_LANDMARKS, HandName, landmark_point
from rhot.messages import HandPoints, MarkerFrame
from rhot.transforms import Array
from services.fusion.step import FusionStep
from services.fusion.synthetic import START_NS, Path, Setup, frames, point_hands
from services.fusion.triangulation import extrinsics, triangulate
from services.pi_tracker.frame import Frame
from services.pi_tracker.step import TrackerStep
from services.simulator.frames import FrameSource
from services.simulator.scene import Scene, build_scene
from services.simulator.scenes import SCENES
from services.solver.step import SolverStep

SEEDS = (1, 2, 3)
SECONDS, WARM_S = 15.0, 1.0
# Methods beside the asynchronous filter, without 1-Euro: what the pairing itself costs.
OTHERS = {
    "nearest": Fusion(method="triangulate", pairing="nearest", filter="none"),
    "linear": Fusion(method="triangulate", pairing="linear", filter="none"),
    "hermite": Fusion(method="triangulate", pairing="hermite", filter="none"),
    "disparity": Fusion(method="disparity", pairing="hermite", filter="none"),
    "kalman_lag2_clocks_as_announced": Fusion(lag_frames=2, tune_clocks=False),
}
Truth = Callable[[float], dict[str, Array]]


class Score:
    """Errors and sigmas of all points told, against truth."""

    def __init__(self) -> None:
        self._errors: list[Array] = []
        self._sigmas: list[Array] = []

    def add(self, told: Iterable[HandPoints], truth: Truth, start_ns: int = START_NS) -> None:
        """Points after WARM_S; truth gives every landmark at seconds after start_ns."""
        for message in told:
            at_s = (message.stamp_ns - start_ns) * 1e-9
            if at_s >= WARM_S and message.points:
                places = truth(at_s)
                self._errors += [np.array(point.position_m) - places[point.name] for point in message.points]
                self._sigmas += [np.array(point.sigma_m) for point in message.points]

    def figures(self) -> dict[str, float]:
        """RMS along the axes and in space (mm), and the mean squared error over variance."""
        errors, sigmas = np.array(self._errors), np.array(self._sigmas)
        x, y, z = (1e3 * np.sqrt(np.mean(errors**2, axis=0))).tolist()
        rms = 1e3 * float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
        nees = float(np.mean((errors / sigmas) ** 2))
        return {name: round(value, 3) for name, value in (("rms", rms), ("x", x), ("y", y), ("z", z), ("nees", nees))}


def synthetic(fusion: Fusion, distance_m: float = 0.7, speed_m_s: float = 0.5, **setup: Any) -> dict[str, float]:
    """Figures of one method over all seeds."""
    found = Score()
    for seed in SEEDS:
        rig, path = Setup(seed=seed, **setup), Path(distance_m=distance_m, speed_m_s=speed_m_s, seed=seed)
        step = FusionStep(rig.config(fusion), rig.rig(), point_hands())
        told = [points for frame in frames(rig, path, SECONDS) for points in step.step(frame)] + step.flush()
        found.add(told, lambda at_s, path=path: dict(zip(BASIC_LANDMARKS, path(np.array([at_s]))[0], strict=True)))  # type: ignore[misc]
    return found.figures()


def depth_bound_mm(distance_m: float, sigma_px: float) -> float:
    """Cramer-Rao bound of the depth from one frame of each camera: the covariance of the triangulation."""
    cameras = tuple(Setup().rig().values())
    R, t = extrinsics(cameras)
    seen = np.einsum("nij,j->ni", R, [0.0375, 0.0, distance_m]) + t
    sigma = sigma_px / cameras[0].focal_px[0]
    return 1e3 * float(np.sqrt(triangulate(seen[:, :2] / seen[:, 2:], np.full(2, sigma), R, t, 3.0).covariance_m2[2, 2]))


def cost(cameras: int = 2, fps: float = 30.0, lag: int = 0) -> dict[str, float]:
    """Microseconds of one frame of six markers: all of it, with and without telling points, and the share of a core."""
    setup = Setup(cameras=cameras, fps=fps, phase_s=1.0 / (fps * cameras))
    given = frames(setup, Path(), 8.0)
    step = FusionStep(setup.config(Fusion(lag_frames=lag)), setup.rig(), point_hands())
    quiet, telling, total = [], [], 0.0
    for number, frame in enumerate(given):
        begin_s = time.perf_counter()
        told = step.step(frame)
        took_s = time.perf_counter() - begin_s
        # Compiling, or loading what was compiled, is over by then.
        if number >= 100:
            (telling if told else quiet).append(took_s)
            total += took_s
    share = total / (8.0 * (len(given) - 100) / len(given))
    return {
        "update_us": round(1e6 * float(np.median(quiet)), 1),
        "update_and_tell_us": round(1e6 * float(np.median(telling)), 1),
        "core_percent": round(100.0 * share, 1),
    }


def make_scene(config: RigConfig, motion: str, distance_m: float, travel_m: tuple[float, float, float], seed: int) -> Scene:
    """A scene of that motion with sensor noise of 5 grey levels."""
    return build_scene(
        config, dataclasses.replace(SCENES[motion], distance_m=distance_m, travel_m=travel_m, travel_hz=0.9, noise=5.0), motion, seed
    )


def detect(config: RigConfig, scene: Scene, seconds: float) -> list[MarkerFrame]:
    """Every camera's pictures through the tracker, in order of exposure; clocks as well known as synchronisation leaves them."""
    found: list[tuple[float, MarkerFrame]] = []
    for name in scene.cameras:
        source = FrameSource(scene, name, recorded=True)
        tracker = TrackerStep(name, load_colors(config.calibration_dir, name), config.tracker, source.camera.size_px, config.colors)
        for seq in range(int(seconds * config.camera_named(name).fps)):
            taken = source.take(seq, START_NS)
            if taken.image is not None:
                frame = Frame(name, seq, taken.stamp_ns, taken.row_time_ns, taken.size_px, taken.image, "i420")
                found.append((taken.time_s, tracker.step(frame, 0, 500_000)))
    return [frame for _, frame in sorted(found, key=lambda entry: entry[0])]


def rendered(config: RigConfig, scene: Scene, fusion: Fusion, given: list[MarkerFrame], *, feedback: bool) -> dict[str, float]:
    """Figures of one method on detected markers; feedback: the solver tells fusion which way the fingers point."""
    config = msgspec.structs.replace(config, fusion=fusion)
    hands: dict[HandName, Any] = {hand: load_hand(config.calibration_dir, hand, table.scale) for hand, table in config.hand.items()}
    step, solver, told = FusionStep(config, scene.cameras, hands), SolverStep(config, hands), []
    for frame in given:
        for points in step.step(frame):
            told.append(points)
            pose = solver.step(points) if feedback else None
            if pose is not None:
                step.note_pose(pose)
    found = Score()

    def truth(at_s: float) -> dict[str, Array]:
        joints = scene.hands["right"].joints(scene.hand_states(at_s)["right"])
        return {name: landmark_point(hands["right"], name, joints[0], joints[1]) for name in config.hand["right"].markers}

    found.add(told + step.flush(), truth)
    return found.figures()


def synthetic_figures() -> dict[str, Any]:
    """Everything from synthetic observations, under the names of the requirements."""
    still = {str(distance_m): synthetic(Fusion(), distance_m, 0.0) for distance_m in (0.5, 1.0)}
    moving = {str(lag): synthetic(Fusion(lag_frames=lag)) for lag in (0, 1, 2)}
    others = {name: synthetic(fusion) for name, fusion in OTHERS.items()}
    noisy = {str(lag): synthetic(Fusion(lag_frames=lag), sigma_px=0.2) for lag in (0, 1, 2)}
    return {
        "still_depth_rms_mm": {distance: figures["z"] for distance, figures in still.items()},
        "still_over_crb": {distance: round(figures["z"] / depth_bound_mm(float(distance), 0.06), 3) for distance, figures in still.items()},
        "still_nees": {distance: figures["nees"] for distance, figures in still.items()},
        "moving_rms_mm": {lag: figures["rms"] for lag, figures in moving.items()},
        "moving_nees": {lag: figures["nees"] for lag, figures in moving.items()},
        "moving_other_methods_rms_mm": {name: figures["rms"] for name, figures in others.items()},
        "moving_noise_0.2px_rms_mm": {lag: figures["rms"] for lag, figures in noisy.items()},
        "moving_clocks_off_10ms_rms_mm": {
            str(lag): synthetic(Fusion(lag_frames=lag), clock_error_s=0.005, clock_sigma_s=0.01)["rms"] for lag in (0, 2)
        },
        **cost(),
        "load_4_cameras_90_fps": cost(4, 90.0),
    }


def rendered_figures(config: RigConfig, seconds: float) -> dict[str, Any]:
    """The same hand in pictures: still at two distances, moving at about 0.5 m/s RMS at 0.7 m, and the fingers alone at 0.5 m."""
    scenes = {
        "still_0.5": make_scene(config, "still", 0.5, (0.0, 0.0, 0.0), 1),
        "still_1.0": make_scene(config, "still", 1.0, (0.0, 0.0, 0.0), 1),
        "moving_0.7": make_scene(config, "random", 0.7, (0.085, 0.06, 0.07), 1),
        "piano_0.5": make_scene(config, "piano", 0.5, (0.0, 0.0, 0.0), 1),
    }
    figures: dict[str, Any] = {}
    for name, scene in scenes.items():
        given = detect(config, scene, seconds)
        for lag in (0, 1, 2):
            for feedback in (False, True):
                key = f"{name}_lag{lag}_{'with' if feedback else 'without'}_finger_direction"
                figures[key] = rendered(config, scene, Fusion(lag_frames=lag), given, feedback=feedback)
    return figures


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=File, help="write the figures to this file")
    parser.add_argument("--rendered", action="store_true", help="also from rendered pictures")
    parser.add_argument("--seconds", type=float, default=6.0, help="length of each rendered scene")
    options = parser.parse_args()
    figures = synthetic_figures()
    if options.rendered:
        config = load_rig(File(__file__).parents[1] / "config" / "sim.toml")
        figures["rendered"] = rendered_figures(config, options.seconds)
    text = json.dumps(figures, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
