"""The solver's step with absurd input: messages, and hand models from a file."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Solver
from rhot.hand import BASIC_LANDMARKS, default_hand
from rhot.messages import HandPoint, HandPoints
from services.solver.step import SolverStep

METHODS = ("dls", "fabrik", "analytic", "dls-paper", "fabrik-paper")

wild = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 1e300, -1e300, 1e-300, 0.5, -3.0]),
)
point = st.builds(
    HandPoint,
    name=st.sampled_from([*BASIC_LANDMARKS, "middle_proximal", "palm", "nose"]),
    position_m=st.one_of(st.tuples(wild, wild, wild), st.tuples(*(st.floats(-0.3, 0.3),) * 3)),
    sigma_m=st.tuples(*(st.one_of(wild, st.just(1e-3)),) * 3),
    cameras=st.just([]),
    source=st.sampled_from(["measured", "predicted"]),
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(
        st.tuples(st.integers(0, 2**63 - 1), st.lists(point, max_size=12)), min_size=1, max_size=4
    ),
    st.sampled_from(METHODS),
)
def test_absurd_input(messages: list[tuple[int, list[HandPoint]]], method: str) -> None:
    """No crash, no hang, no NaN, no limit crossed, whatever valid JSON may say."""
    step, limits = (
        SolverStep(RigConfig(solver=Solver(method=method)), {"right": default_hand()}),
        default_hand().limits_rad,
    )
    good = {name: (0.01 * i, 0.05 if i else 0.0, 0.5) for i, name in enumerate(BASIC_LANDMARKS)}
    start = [
        HandPoint(name=n, position_m=p, sigma_m=(1e-3,) * 3, cameras=[], source="measured")
        for n, p in good.items()
    ]
    for seq, (stamp, points) in enumerate([(0, start), *messages]):
        pose = step.step(HandPoints(hand="right", seq=seq, stamp_ns=stamp, points=points))
        if pose is not None:
            assert b"null" not in msgspec.json.encode(pose)
            for row, finger in enumerate(pose.fingers):
                q = finger.model_angles_rad
                assert np.all(
                    (np.array(q) >= limits[row, :, 0]) & (np.array(q) <= limits[row, :, 1])
                )


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("limits_rad", ((0.1, -0.1),) * 4),
        ("limits_rad", ((float("nan"), 0.1),) * 4),
        ("base_wxyz", (0.0, 0.0, 0.0, 0.0)),
        ("base_m", (float("inf"), 0.0, 0.0)),
        ("coupling_weight", -1.0),
        ("name", "index"),
    ],
)
def test_a_hand_that_cannot_be_solved_with_is_refused(field: str, value: object) -> None:
    model = default_hand()
    thumb = msgspec.structs.replace(model.digits[0], **{field: value})
    with pytest.raises(CalibrationError, match=r"hand\.right\.json"):
        SolverStep(
            RigConfig(),
            {"right": msgspec.structs.replace(model, digits=(thumb, *model.digits[1:]))},
        )


def test_a_hand_without_paint_is_refused() -> None:
    with pytest.raises(CalibrationError, match="wrist"):
        SolverStep(RigConfig(), {"right": msgspec.structs.replace(default_hand(), paint={})})


def test_bones_of_no_length_are_no_error(world: Callable) -> None:
    ours = world("right")
    digits = tuple(msgspec.structs.replace(d, lengths_m=(0.0, 0.0, 0.0)) for d in ours.model.digits)
    ours = type(ours)(msgspec.structs.replace(ours.model, digits=digits))
    step = SolverStep(RigConfig(), {"right": ours.model})
    for frame, instant in enumerate(ours.motion(13, 3)):
        pose = step.step(ours.message(ours.points(instant), frame))
        assert pose is not None
        # What is no number would go out as null, as the misfit of a known hand does.
        assert pose.model_misfit is None
        assert b"null" not in msgspec.json.encode(msgspec.structs.replace(pose, model_misfit=0.0))
