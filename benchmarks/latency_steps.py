"""Steps, decoding and encoding of the way from a marker to a pose, alone in one process."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
from latency_rig import Recording

from rhot.hand import HandModel, HandName, default_hand
from rhot.messages import HandPoints, MarkerFrame
from services.fusion.step import FusionStep
from services.solver.maths.chains import hand_chains
from services.solver.step import SolverStep
from services.solver.whole_hand.fit import fit
from services.solver.whole_hand.landmarks import hand_landmarks, observation_arrays
from services.solver.whole_hand.point_check import usable_points
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, uninformed_prior
from services.solver.whole_hand.priors.posture_prior import posture_prior
from services.solver.whole_hand.residuals import Pose

# Of each list of times, unless it is shorter: filters and caches have settled by then.
_WARM = 30
# Of the kernel that steps are held against; a pose that follows another takes 4.
_ITERATIONS = 4
# Hands that begin, and frames by which each has.
_BEGINNINGS, _FIRST = 30, 6


def alone_us(recording: Recording) -> dict[str, float]:
    """Medians in us of processor time, over a recording; fusion hears the poses as it does live.

    Processor time: what else this machine does is not counted.
    """
    hands: dict[HandName, HandModel] = {"right": default_hand("right")}
    fusion = FusionStep(recording.rig.config(), recording.rig.rig(), hands)
    solver = SolverStep(recording.rig.config(), hands)
    times: dict[str, list[float]] = {}

    def timed(name: str, call: Callable[..., Any], *arguments: Any) -> Any:
        begin_ns = time.thread_time_ns()
        result = call(*arguments)
        times.setdefault(name, []).append((time.thread_time_ns() - begin_ns) * 1e-3)
        return result

    encode = msgspec.json.Encoder().encode
    decode_markers = msgspec.json.Decoder(MarkerFrame).decode
    decode_points = msgspec.json.Decoder(HandPoints).decode
    for frame, due in zip(recording.frames, recording.points, strict=True):
        taken = timed("decode_markers", decode_markers, msgspec.json.encode(frame))
        told = timed("fusion_silent" if due is None else "fusion_telling", fusion.step, taken)
        timed("fusion_settle", fusion.settle)
        for points in told:
            heard = timed("decode_points", decode_points, timed("encode_points", encode, points))
            pose = timed("solver", solver.step, heard)
            if solver.challenge_due("right"):
                timed("challenge", solver.challenge, "right")
            if pose is not None:
                timed("encode_pose", encode, pose)
                fusion.note_pose(pose)
    _time_kernel(recording, timed)
    _time_beginning(recording, hands, times)
    found = {name: float(np.median(values[_WARM:] or values)) for name, values in times.items()}
    # Rare and long: searches and regressions of clocks, which a median does not show.
    found["fusion_settle_mean"] = float(np.mean(times["fusion_settle"][_WARM:]))
    kernel_us = found["hand_fit"]
    ratios = {f"{name}_over_fit": found[name] / kernel_us for name in ("fusion_telling", "solver")}
    return {**found, **ratios}


def _time_beginning(
    recording: Recording, hands: dict[HandName, HandModel], times: dict[str, list[float]]
) -> None:
    """The longest of the first frames' steps: the one in which all landmarks of a hand begin."""
    for _ in range(_BEGINNINGS):
        fusion = FusionStep(recording.rig.config(), recording.rig.rig(), hands)
        fusion.step(recording.frames[0])  # it begins anew with the first frame, which is no hand's
        took = []
        for frame in recording.frames[1:_FIRST]:
            begin_ns = time.thread_time_ns()
            fusion.step(frame)
            took.append((time.thread_time_ns() - begin_ns) * 1e-3)
        times.setdefault("fusion_begins", []).append(max(took))


def _time_kernel(recording: Recording, timed: Callable[..., Any]) -> None:
    """The compiled fit of a whole hand alone, from the middle of its range in 4 iterations."""
    model = default_hand("right")
    chains, landmarks = hand_chains(model), hand_landmarks(model)
    prior = uninformed_prior(posture_prior(model))
    found = np.empty((UNKNOWNS, UNKNOWNS))
    for points in filter(None, recording.points):
        seen = observation_arrays(landmarks, usable_points(points, landmarks))
        place = seen.point_m.mean(axis=0) if len(seen.point_m) else np.zeros(3)
        pose = Pose(np.eye(3), place, model.limits_rad.mean(axis=2))
        timed("hand_fit", fit, chains, seen, prior, pose, _ITERATIONS, found)
