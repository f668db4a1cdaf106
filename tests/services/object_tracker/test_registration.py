"""Which frame poses are in: the file of the registration, universes, what SteamVR moves, and how
sure all of it is.
"""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.files.calibration import ObjectPlace, Objects, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import RigTable
from rhot.geometry.transforms import rotation_from_vector, transform
from rhot.messages.objects import OpenVrEvent
from services.object_tracker.registration import load_registration
from services.object_tracker.step import ObjectStep
from testing.openvr_poses import openvr_pose, registered

MS = 1_000_000
T0 = 1_700_000_000_000_000_000


def test_without_registration_poses_stay_in_the_lighthouse_frame(config: RigConfig) -> None:
    T = transform(rotation_from_vector([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3])
    result = ObjectStep(config, None).step(openvr_pose(T, vVelocity=(1.0, 2.0, 3.0)))
    assert result is not None
    assert not result.registered
    assert result.position_m == (0.1, 0.2, 0.3)
    assert result.velocity_m_s == (1.0, 2.0, 3.0)


BAD_FILES = {
    "scaled": {"T_rig_from_lighthouse": (2.0 * np.eye(4)).tolist()},
    "mirrored": {"T_rig_from_lighthouse": np.diag([1.0, 1.0, -1.0, 1.0]).tolist()},
    "bottom row": {
        "T_rig_from_lighthouse": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 1]]
    },
    "huge": {"T_rig_from_lighthouse": (1e300 * np.eye(4)).tolist()},
    "quaternion": {"objects": {"cup": {"orientation_wxyz": [0, 0, 0, 0]}}},
    "long quaternion": {"objects": {"cup": {"orientation_wxyz": [1e300, 0, 0, 1e300]}}},
}


@pytest.mark.parametrize("fault", BAD_FILES)
def test_impossible_registrations_are_refused(config: RigConfig, fault: str) -> None:
    file = msgspec.convert(
        {"T_rig_from_lighthouse": np.eye(4).tolist()} | BAD_FILES[fault], Objects
    )
    with pytest.raises(CalibrationError, match="run `rhot calibrate objects` again"):
        ObjectStep(config, file)


def test_registration_file(tmp_path: Path) -> None:
    rig = RigConfig(rig=RigTable(calibration="c"), folder=str(tmp_path))
    assert load_registration(rig) is None
    file = registered(objects={"cup": ObjectPlace(offset_m=(0.03, -0.05, 0.11))})
    save(tmp_path / "c" / "objects.json", file)
    assert load_registration(rig) == file
    (tmp_path / "c" / "objects.json").write_text("{}")
    with pytest.raises(CalibrationError, match="T_rig_from_lighthouse"):
        load_registration(rig)


def test_another_universe_makes_the_registration_stale_until_it_is_made_anew(
    config: RigConfig,
) -> None:
    step = ObjectStep(config, registered(universe="raw:1"))
    names = ["raw:1", "raw", "raw:1", "raw:2", "raw:1"]
    results = [
        step.step(openvr_pose(seq=k, stamp_ns=T0 + k * MS, universe=name))
        for k, name in enumerate(names)
    ]
    states = [(one.tracking, one.registered) for one in results if one is not None]
    assert states == [("ok", True)] * 3 + [("unregistered", False)] * 2
    (text,) = step.faults(T0)["registration_stale"].values()
    assert "'raw:2'" in text
    assert "'raw:1'" in text
    assert step.values()["registered"] == 0.0


def test_without_a_name_in_the_file_the_first_universe_is_the_registered_one(
    config: RigConfig,
) -> None:
    step = ObjectStep(config, registered())
    first = step.step(openvr_pose(seq=0, universe="a"))
    second = step.step(openvr_pose(seq=1, stamp_ns=T0 + MS, universe="b"))
    assert first is not None
    assert second is not None
    assert (first.tracking, second.tracking) == ("ok", "unregistered")


@pytest.mark.parametrize(("number", "holds"), [(801, False), (804, True), (808, True), (100, True)])
def test_events(config: RigConfig, number: int, holds: bool) -> None:
    step = ObjectStep(config, registered())
    event = OpenVrEvent(v=1, stamp_ns=T0, event_type=number, name="SomethingMoved")
    warning = step.event(event)
    result = step.step(openvr_pose())
    assert result is not None
    assert result.registered is holds
    assert bool(step.faults(T0)["registration_stale"]) is not holds
    assert (warning is not None) == (number in (804, 808))


def test_sigma_grows_with_the_registrations(config: RigConfig) -> None:
    T = transform(np.eye(3), [3.0, 0.0, 0.0])

    def sigma(**fields) -> float:
        step = ObjectStep(config, registered(**fields))
        results = [step.step(openvr_pose(T, seq=k, stamp_ns=T0 + k * 4 * MS)) for k in range(50)]
        last = results[-1]
        assert last is not None
        assert last.sigma_m is not None
        return last.sigma_m

    of_tracker = sigma()
    assert 0.2e-3 < of_tracker < 2e-3
    assert sigma(sigma_m=5e-3) == pytest.approx(math.hypot(of_tracker, 5e-3), abs=1e-6)
    # A milliradian at 2 m.
    turned = sigma(sigma_m=5e-3, sigma_rad=1e-3, middle_m=(1.0, 0.0, 0.0))
    assert turned == pytest.approx(math.hypot(of_tracker, 5e-3, 2e-3), abs=1e-6)
    assert sigma(sigma_m=math.nan, sigma_rad=-1.0) == of_tracker
