"""The figures of accuracy.py that are from points: fusion's own errors, without a tracker's."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from accuracy_pictures import Score

from rhot.files.rig_tables import Fusion
from rhot.geometry.transforms import Array
from rhot.hand import BASIC_LANDMARKS
from services.fusion.geometry.projection import extrinsics
from services.fusion.geometry.triangulation import triangulate
from services.fusion.step import FusionStep
from testing.families.points import Gaps, with_gaps
from testing.gesture_points import SWAYING, hand_at, motion_of
from testing.synthetic_points import (
    Motion,
    MovingHand,
    RestingHand,
    SyntheticRig,
    frames,
    point_hands,
)

SEEDS = (1, 2, 3)
SECONDS = 15.0
# Of the simulator; the last is the liveliest.
GESTURES = ("random", "piano", "fist", SWAYING + "random")
# Methods beside the asynchronous filter, without 1-Euro: what the pairing itself costs.
OTHERS = {
    "nearest": Fusion(method="triangulate", pairing="nearest", filter="none"),
    "linear": Fusion(method="triangulate", pairing="linear", filter="none"),
    "hermite": Fusion(method="triangulate", pairing="hermite", filter="none"),
    "disparity": Fusion(method="disparity", pairing="hermite", filter="none"),
    "kalman_lag2_clocks_as_announced": Fusion(lag_frames=2, tune_clocks=False),
}


def synthetic_figures() -> dict[str, Any]:
    """The same from synthetic observations."""
    still = {str(z_m): synthetic(Fusion(), functools.partial(_resting, z_m)) for z_m in (0.5, 1.0)}
    moving = {str(lag): synthetic(Fusion(lag_frames=lag)) for lag in (0, 1, 2)}
    others = {name: synthetic(fusion) for name, fusion in OTHERS.items()}
    noisy = {str(lag): synthetic(Fusion(lag_frames=lag), sigma_px=0.2) for lag in (0, 1, 2)}
    return {
        "still_depth_rms_mm": {distance: figures["z"] for distance, figures in still.items()},
        "still_over_crb": {
            distance: round(figures["z"] / depth_bound_mm(float(distance), 0.06), 3)
            for distance, figures in still.items()
        },
        "still_nees": {distance: figures["nees"] for distance, figures in still.items()},
        "moving_rms_mm": {lag: figures["rms"] for lag, figures in moving.items()},
        "moving_nees": {lag: figures["nees"] for lag, figures in moving.items()},
        "moving_other_methods_rms_mm": {name: figures["rms"] for name, figures in others.items()},
        "moving_noise_0.2px_rms_mm": {lag: figures["rms"] for lag, figures in noisy.items()},
        "moving_clocks_off_10ms_rms_mm": {
            str(lag): synthetic(Fusion(lag_frames=lag), clock_error_s=0.005, clock_sigma_s=0.01)[
                "rms"
            ]
            for lag in (0, 2)
        },
        **gestures(),
    }


def _resting(distance_m: float, seed: int) -> RestingHand:
    return RestingHand(distance_m=distance_m, seed=seed)


def synthetic(
    fusion: Fusion,
    of_seed: Callable[[int], Motion] = lambda seed: MovingHand(seed=seed),
    missing: float = 0.0,
    **setup: Any,
) -> dict[str, float]:
    """Figures of one method over all seeds; of_seed makes the motion of a seed.

    missing: this share of markers is left out.
    """
    found = Score()
    for seed in SEEDS:
        rig = SyntheticRig(seed=seed, **setup)
        motion = of_seed(seed)
        step = FusionStep(rig.config(fusion), rig.rig(), point_hands())
        given = with_gaps(frames(rig, motion, SECONDS), Gaps(share=missing, seed=seed), rig)
        messages = [points for frame in given for points in step.step(frame)]
        found.add(messages + step.flush(), functools.partial(truth, motion))
    return found.figures()


def gesture(name: str, seed: int) -> Motion:
    """One of the simulator's gestures as points."""
    model = point_hands()["right"]
    return motion_of(model, hand_at(name, model, seed))


def gestures() -> dict[str, Any]:
    """RMS by lag of hands that move as joints let them, and of a fifth of the markers missing.

    Fingers of MovingHand are points that go their own ways.
    """
    return {
        "gesture_rms_mm": {
            name: {
                str(lag): synthetic(Fusion(lag_frames=lag), functools.partial(gesture, name))["rms"]
                for lag in (0, 1, 2)
            }
            for name in GESTURES
        },
        "missing_20_percent_rms_mm": {
            name: {
                str(lag): synthetic(Fusion(lag_frames=lag), of_seed, missing=0.2)["rms"]
                for lag in (0, 1, 2)
            }
            for name, of_seed in (
                (GESTURES[-1], functools.partial(gesture, GESTURES[-1])),
                ("moving", lambda seed: MovingHand(seed=seed)),
            )
        },
    }


def truth(motion: Motion, at_s: float) -> dict[str, Array]:
    """Every landmark's place (3,) at an instant."""
    return dict(zip(BASIC_LANDMARKS, motion(np.array([at_s]))[0], strict=True))


def depth_bound_mm(distance_m: float, sigma_px: float) -> float:
    """Cramer-Rao bound of the depth from one frame of each camera: the triangulation's sigma."""
    cameras = tuple(SyntheticRig().rig().values())
    poses = extrinsics(cameras)
    p_cameras = np.einsum("nij,j->ni", poses.R, [0.0375, 0.0, distance_m]) + poses.t  # (2, 3)
    rays = p_cameras[:, :2] / p_cameras[:, 2:]
    sigmas = np.full(2, sigma_px / cameras[0].focal_px[0])
    return 1e3 * float(np.sqrt(triangulate(rays, sigmas, poses, 3.0).covariance_m2[2, 2]))
