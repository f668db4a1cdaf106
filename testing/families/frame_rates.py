"""Cases whose cameras deliver fewer frames: slow ones, and ones that lose frames at random."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import msgspec
import numpy as np

from rhot.messages import MarkerFrame
from testing.families.case import Case


def every(case: Case, step: int, *, told: bool) -> Case:
    """One of so many frames of each camera; told: rig.toml has that rate, too."""
    thinned = _only(case, lambda frame: frame.seq % step == 0)
    if not told:
        return thinned
    cameras = [msgspec.structs.replace(one, fps=one.fps / step) for one in case.config.camera]
    config = msgspec.structs.replace(case.config, camera=cameras)
    return dataclasses.replace(thinned, config=config)


def with_frames_lost(case: Case, share: float, seed: int) -> Case:
    """A share of all frames lost, each by itself; rig.toml does not know."""
    random = np.random.default_rng([seed, 23])
    return _only(case, lambda _frame: random.random() >= share)


def _only(case: Case, wanted: Callable[[MarkerFrame], bool]) -> Case:
    kept = [n for n, frame in enumerate(case.frames) if wanted(frame)]
    frames = [case.frames[n] for n in kept]
    return dataclasses.replace(case, frames=frames, visible=case.visible[kept])
