"""The simulated rig of config/sim.toml, and one renderer of a moving scene for all tests of this
room.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot.files.config import RigConfig, load_rig
from services.simulator.render.renderer import Renderer
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import Scene, build_scene, load_scene


@pytest.fixture(scope="session")
def config(repository: Path) -> RigConfig:
    """config/sim.toml."""
    return load_rig(repository / "config" / "sim.toml")


@pytest.fixture(scope="session")
def fist(config: RigConfig) -> Scene:
    """The finger study's grasp."""
    return load_scene(config, "fist", seed=1)


@pytest.fixture(scope="session")
def fast(config: RigConfig) -> Scene:
    """An open hand that rushes sideways at up to 1.3 m/s, before the usual wall."""
    spec = dataclasses.replace(SCENES["still"], travel_m=(0.10, 0.0, 0.0), travel_hz=2.0)
    return build_scene(config, spec, "fast", seed=1)


@pytest.fixture(scope="session")
def renderer(fist: Scene) -> Renderer:
    """The left camera's.

    Give every call its own time: a renderer keeps nothing from picture to picture.
    """
    return Renderer(fist, "left")


@pytest.fixture(scope="session")
def planes() -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Y, U, V as int64 planes of an I420 picture."""

    def split(image: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        height, width = image.shape[0] * 2 // 3, image.shape[1]
        flat = image.reshape(-1).astype(np.int64)
        luma, quarter = height * width, height * width // 4
        u, v = flat[luma : luma + quarter], flat[luma + quarter :]
        return (
            flat[:luma].reshape(height, width),
            u.reshape(height // 2, -1),
            v.reshape(height // 2, -1),
        )

    return split


@pytest.fixture(autouse=True, scope="session")
def _one_thread() -> None:
    """OpenCV's threads gain nothing here, and the machine is shared."""
    cv2.setNumThreads(1)
