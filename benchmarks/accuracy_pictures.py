"""Hands in pictures for accuracy.py: rendered, detected, fused, and compared with the truth."""

from __future__ import annotations

import dataclasses
import functools
from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any

import msgspec
import numpy as np

from rhot.files.calibration import load_hand
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Fusion
from rhot.geometry.transforms import Array
from rhot.hand import HandName, landmark_point
from rhot.messages import HandPoints, MarkerFrame
from services.fusion.step import FusionStep
from services.simulator.hands.families import VARIED
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import Scene, build_scene
from services.solver.step import SolverStep
from testing.rendered_markers import detect
from testing.synthetic_points import START_NS

RENDERED_SEEDS = (1, 2, 3, 4)
# Tracks have started and clock offsets are estimated by then.
WARM_S = 1.0
Truth = Callable[[float], dict[str, Array]]
Detector = Callable[[RigConfig, Scene, float], list[MarkerFrame]]


class Score:
    """Errors and sigmas of all points, against truth."""

    def __init__(self) -> None:
        self._errors: list[Array] = []
        self._sigmas: list[Array] = []
        # The depth errors of each landmark of each run.
        self._depths: dict[tuple[int, str], list[float]] = defaultdict(list)
        self._runs = 0

    def add(self, messages: Iterable[HandPoints], truth: Truth, start_ns: int = START_NS) -> None:
        """Points after WARM_S; truth gives every landmark at seconds after start_ns."""
        self._runs += 1
        for message in messages:
            at_s = (message.stamp_ns - start_ns) * 1e-9
            if at_s >= WARM_S and message.points:
                places = truth(at_s)
                self._errors += [
                    np.array(point.position_m) - places[point.name] for point in message.points
                ]
                self._sigmas += [np.array(point.sigma_m) for point in message.points]
                for point in message.points:
                    self._depths[self._runs, point.name].append(
                        point.position_m[2] - float(places[point.name][2])
                    )

    def precision_z_mm(self) -> float:
        """RMS of the depth errors about the mean of each landmark in each run."""
        centred = [np.array(errors) - np.mean(errors) for errors in self._depths.values()]
        return 1e3 * float(np.sqrt(np.mean(np.concatenate(centred) ** 2)))

    def bias_z_mm(self) -> float:
        """RMS of these means."""
        return 1e3 * float(
            np.sqrt(np.mean([np.mean(errors) ** 2 for errors in self._depths.values()]))
        )

    def figures(self) -> dict[str, float]:
        """RMS along the axes and in space (mm), and the mean squared error over variance."""
        errors, sigmas = np.array(self._errors), np.array(self._sigmas)
        x, y, z = (1e3 * np.sqrt(np.mean(errors**2, axis=0))).tolist()
        rms = 1e3 * float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))
        nees = np.mean((errors / sigmas) ** 2, axis=0)
        named = (
            ("rms", rms),
            ("x", x),
            ("y", y),
            ("z", z),
            ("nees", float(nees.mean())),
            ("nees_z", float(nees[2])),
        )
        return {name: round(value, 3) for name, value in named}


def make_scene(
    config: RigConfig,
    motion: str,
    distance_m: float,
    travel_m: tuple[float, float, float],
    seed: int,
) -> Scene:
    """A scene of that motion with sensor noise of 5 grey levels."""
    recipe = dataclasses.replace(
        SCENES[motion], distance_m=distance_m, travel_m=travel_m, travel_hz=0.9, noise=5.0
    )
    return build_scene(config, recipe, motion, seed)


class Pictures:
    """One motion at one distance, rendered and detected for every seed.

    Each method then runs on the same markers.
    """

    def __init__(
        self,
        config: RigConfig,
        motion: str,
        distance_m: float,
        travel_m: tuple[float, float, float],
        seconds: float,
        seeds: tuple[int, ...] = RENDERED_SEEDS,
        detector: Detector = detect,
    ) -> None:
        self._config = config
        self.distance_m = distance_m
        self._scenes = [make_scene(config, motion, distance_m, travel_m, seed) for seed in seeds]
        self._given = [detector(config, scene, seconds) for scene in self._scenes]
        # The hands that are rendered: what fusion is told of them is exact.
        self._hands: dict[HandName, Any] = {
            hand: msgspec.structs.replace(
                load_hand(config.calibration_dir, hand, table.scale), origin=VARIED
            )
            for hand, table in config.hand.items()
        }
        # What each scene's truth was asked for already: kinematics take longer than fusion.
        self._known: list[dict[float, dict[str, Array]]] = [{} for _ in self._scenes]

    def score(self, fusion: Fusion, *, feedback: bool = True) -> Score:
        """One method.

        Feedback: the solver tells fusion which way the fingers point, as it does in a running rig.
        """
        config, found = msgspec.structs.replace(self._config, fusion=fusion), Score()
        for number, scene in enumerate(self._scenes):
            step = FusionStep(config, scene.cameras, self._hands)
            solver = SolverStep(config, self._hands)
            messages = []
            for frame in self._given[number]:
                for points in step.step(frame):
                    messages.append(points)
                    pose = solver.step(points) if feedback else None
                    if pose is not None:
                        step.note_pose(pose)
            found.add(messages + step.flush(), functools.partial(self._truth, number))
        return found

    def _truth(self, number: int, at_s: float) -> dict[str, Array]:
        known = self._known[number]
        if at_s not in known:
            scene = self._scenes[number]
            positions, rotations = scene.hands["right"].joints(scene.hand_states(at_s)["right"])
            known[at_s] = {
                name: landmark_point(self._hands["right"], name, positions, rotations)
                for name in self._config.hand["right"].markers
            }
        return known[at_s]

    def detector_noise_px(self) -> float:
        """How much a resting marker's x scatters from frame to frame, RMS of all.

        By second differences, in which the motion of a still hand cancels.
        """
        squares = []
        for given in self._given:
            tracks: dict[tuple[str, str], list[float]] = defaultdict(list)
            for frame in given:
                for marker in frame.markers:
                    tracks[frame.camera, marker.color].append(marker.x_px)
            # A second difference has 1 + 4 + 1 times the variance.
            squares += [
                float(np.mean(np.diff(xs, 2) ** 2)) / 6.0 for xs in tracks.values() if len(xs) > 30
            ]
        return float(np.sqrt(np.mean(squares)))
