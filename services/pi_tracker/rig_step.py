"""A camera's tracker as rig.toml and its calibration have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rhot.files.calibration import Colors, load_lens
from rhot.files.config import RigConfig
from services.pi_tracker.step import Clock, TrackerStep


def step_of_rig(
    config: RigConfig,
    camera: str,
    colors: Colors,
    names: Sequence[str] | None = None,
    *,
    clock: Clock | None = None,
    colors_path: Path | str = "",
    seeds: Mapping[str, tuple[float, float]] | None = None,
    remembers_dots: bool = False,
) -> TrackerStep:
    """A tracker for the colours `names`, or else for those of the rig's markers.

    The rest is as TrackerStep has it, whose errors it raises, and those of a lens that is needed.
    """
    lens = load_lens(config.calibration_dir, camera) if config.tracker.rectify else None
    table = config.camera_named(camera)
    return TrackerStep(
        camera,
        colors,
        config.tracker,
        table.size_px,
        config.colors if names is None else names,
        clock,
        colors_path,
        lens,
        config.dots,
        seeds,
        remembers_dots=remembers_dots,
        landmarks=config.landmarks,
        readout_ms=table.readout_ms,
    )
