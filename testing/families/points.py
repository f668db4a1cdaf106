"""Cases of points: geometry, timing and noise alone, by testing/synthetic_points.py. Pure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import msgspec
import numpy as np

from rhot.hand import BASIC_LANDMARKS
from rhot.messages import MarkerFrame
from testing.families.case import Case
from testing.synthetic_points import (
    COLORS,
    Motion,
    SyntheticRig,
    frames,
    point_hands,
)

SECONDS = 8.0


@dataclass(frozen=True)
class Gaps:
    """Which markers a case leaves out.

    share: of all, at random. blind: (camera's number, landmarks' numbers, begin_s, length_s), and
    again every `every_s` seconds.
    """

    share: float = 0.0
    blind: tuple[tuple[int, tuple[int, ...], float, float], ...] = ()
    every_s: float = 2.0
    seed: int = 1


@dataclass(frozen=True)
class Wander:
    """Noise that is not white: a share of it stays from frame to frame.

    Each marker's error follows an AR(1) process of `correlation`, sigma_px in all, on top of the
    rig's white noise.
    """

    sigma_px: float
    correlation: float
    seed: int = 1


def point_case(
    name: str,
    motion: Motion,
    rig: SyntheticRig | None = None,
    gaps: Gaps | None = None,
    wander: Wander | None = None,
) -> Case:
    """A case of points; SyntheticRig() and nothing left out unless told otherwise."""
    setup = rig or SyntheticRig()
    given = frames(setup, motion, SECONDS)
    if wander is not None:
        given = _wandering(given, wander, setup)
    if gaps is not None:
        given = with_gaps(given, gaps, setup)
    shown = [{marker.color for marker in frame.markers} for frame in given]
    sign = {camera: -1.0 if n % 2 else 1.0 for n, camera in enumerate(setup.names)}
    return Case(
        name=name,
        config=setup.config(),
        cameras=setup.rig(),
        hands=point_hands(),
        frames=given,
        visible=np.array([[float(color in colors) for color in COLORS] for colors in shown]),
        landmarks=BASIC_LANDMARKS,
        truth=motion,
        seconds=SECONDS,
        # Offsets are announced as clock + error: taking them off leaves minus the error.
        clock_errors_s={camera: -sign[camera] * setup.clock_error_s for camera in setup.names},
    )


def with_gaps(given: list[MarkerFrame], gaps: Gaps, setup: SyntheticRig) -> list[MarkerFrame]:
    rng = np.random.default_rng([gaps.seed, 6])
    kept = []
    for frame in given:
        hidden = {color for color in COLORS if rng.random() < gaps.share}
        time_s = frame.seq / setup.fps
        for camera, landmarks, begin_s, length_s in gaps.blind:
            is_blind = (time_s - begin_s) % gaps.every_s < length_s and time_s >= begin_s
            if setup.names[camera] == frame.camera and is_blind:
                hidden |= {COLORS[n] for n in landmarks}
        markers = [marker for marker in frame.markers if marker.color not in hidden]
        kept.append(msgspec.structs.replace(frame, markers=markers))
    return kept


def _wandering(given: list[MarkerFrame], wander: Wander, setup: SyntheticRig) -> list[MarkerFrame]:
    rng = np.random.default_rng([wander.seed, 7])
    fresh_px = wander.sigma_px * np.sqrt(1.0 - wander.correlation**2)
    state = {
        (camera, color): rng.normal(0.0, wander.sigma_px, 2)
        for camera in setup.names
        for color in COLORS
    }
    moved = []
    for frame in given:
        markers = []
        for marker in frame.markers:
            key = (frame.camera, marker.color)
            state[key] = wander.correlation * state[key] + rng.normal(0.0, fresh_px, 2)
            x, y = (state[key] + (marker.x_px, marker.y_px)).tolist()
            sigma_px = float(np.hypot(marker.sigma_px, wander.sigma_px))
            markers.append(
                msgspec.structs.replace(
                    marker, x_px=round(x, 4), y_px=round(y, 4), sigma_px=round(sigma_px, 4)
                )
            )
        moved.append(msgspec.structs.replace(frame, markers=markers))
    return moved


def lazily(motion: Callable[[], Motion], **more: object) -> Callable[[str], Case]:
    """A maker of a case whose motion is made only when it is needed."""
    return lambda name: point_case(name, motion(), **more)  # type: ignore[arg-type]
