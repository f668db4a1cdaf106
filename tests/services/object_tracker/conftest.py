"""Poses and rigs for the object tracker's tests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.messages.objects import OpenVrPose
from testing.openvr_poses import openvr_pose


@pytest.fixture(scope="session")
def config() -> RigConfig:
    """A rig with one object, `cup`, on the tracker LHR-1."""
    return RigConfig(object=[ObjectTable(name="cup", serial="LHR-1")])


@pytest.fixture(scope="session")
def make_pose() -> Callable[..., OpenVrPose]:
    """An OpenVrPose of LHR-1 at a transform, any field replaceable."""
    return openvr_pose


@pytest.fixture
def vive(rhot_data: Path) -> Path:
    """The real lighthouse recordings."""
    return rhot_data / "vive"
