"""Run every kernel once, so that compiling is over before the first message counts.

With a warm numba cache (rhot.kernels.numba_cache) this takes under a second, without one about a
minute on a small machine. Needs no input.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np

from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS, HandModel, HandName, forward, landmark_point
from rhot.messages import HandPoint, HandPoints
from services.solver.step import SolverStep


def warm_up(config: RigConfig, hands: Mapping[HandName, HandModel]) -> None:
    """Solve five messages of a made-up hand with the configured method: of one it is elsewhere, of
    one a point is; and look for another posture of it.
    """
    for name, model in hands.items():
        step = SolverStep(config, {name: model})
        angles = model.limits_rad.mean(axis=2)
        joints = forward(model, np.eye(3), np.array([0.0, 0.0, 0.5]), angles)
        points = HandPoints(
            hand=name,
            seq=0,
            stamp_ns=0,
            points=[
                HandPoint(
                    name=landmark,
                    position_m=tuple(landmark_point(model, landmark, *joints).tolist()),
                    sigma_m=(1e-3, 1e-3, 1e-3),
                    cameras=[],
                    source="measured",
                )
                for landmark in BASIC_LANDMARKS
            ],
        )
        # Landmarks that change places: what is told glides there.
        places = [point.position_m for point in points.points]
        turned = [
            msgspec.structs.replace(point, position_m=place)
            for point, place in zip(points.points, places[1:] + places[:1], strict=True)
        ]
        for seq, shown in enumerate((points.points, points.points, turned, points.points)):
            message = msgspec.structs.replace(points, seq=seq, points=shown)
            step.step(msgspec.structs.replace(message, stamp_ns=seq * 33_000_000))
        first, *others = points.points
        astray = msgspec.structs.replace(first, position_m=(5.0, 5.0, 5.0))
        step.step(msgspec.structs.replace(points, seq=4, stamp_ns=10**9, points=[astray, *others]))
        step.challenge(name)
