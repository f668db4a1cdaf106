"""Registrations as calibration/objects.json, keeping what other objects had. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from statistics import median
from typing import Any

import msgspec
import numpy as np

from rhot.files.calibration import Matrix4, ObjectPlace, Objects, Row3
from rhot.geometry.transforms import Array
from services.calibrator.objects.points import PointRegistration
from services.calibrator.objects.result import ObjectRegistration

TOOL = "rhot calibrate objects"


def objects_file(
    found: ObjectRegistration,
    names: Mapping[str, str],
    before: Objects | None,
    others: Iterable[str],
    made: tuple[str, dict[str, Any]],
) -> Objects:
    """The file; names is object by serial, before what there was, others the objects of rig.toml,
    made its date and inputs.

    Registered objects keep where they sit on their trackers. Those that never were registered have
    the same delay as these: one SteamVR reports them all.
    """
    places = dict(before.objects) if before else {}
    for serial, tracker in found.trackers.items():
        places[names[serial]] = msgspec.structs.replace(
            places.get(names[serial], ObjectPlace()),
            time_offset_ns=tracker.time_offset_ns,
            marker_m=_row3(tracker.marker_m),
        )
    usual_ns = round(median(tracker.time_offset_ns for tracker in found.trackers.values()))
    for name in others:
        places.setdefault(name, ObjectPlace(time_offset_ns=usual_ns))
    date, inputs = made
    residuals = {
        "rms_px": _short(found.residual.px),
        "rms_mm": _short(found.residual.mm),
        "held_out_px": _short(found.held_out.px),
        "held_out_mm": _short(found.held_out.mm),
        "sightings": found.inliers,
        "left_out": found.rejected,
        "poses_left_out": found.rejected_poses,
        "seconds": _short(found.seconds),
        "extent_m": [_short(value) for value in found.extent_m.tolist()],
        "covariance": [[float(f"{v:.3e}") for v in row] for row in found.covariance.tolist()],
        "trackers": {
            names[serial]: {
                "marker_sigma_mm": [_short(1e3 * v) for v in tracker.marker_sigma_m.tolist()],
                "time_offset_sigma_ms": _short(1e-6 * tracker.time_offset_sigma_ns),
            }
            for serial, tracker in found.trackers.items()
        },
    }
    return Objects(
        date=date,
        tool=TOOL,
        inputs=inputs,
        residuals=residuals,
        T_rig_from_lighthouse=_rows(found.T_rig_from_lighthouse),
        universe=found.universe,
        sigma_rad=_short(found.sigma_rad),
        sigma_m=_short(found.sigma_m),
        middle_m=_row3(found.middle_m),
        objects=places,
    )


def points_file(
    found: PointRegistration,
    name: str,
    universe: str,
    middle_m: Array,
    before: Objects | None,
    made: tuple[str, dict[str, Any]],
) -> Objects:
    """The file from points that were measured by other means.

    The paint of the object's tracker is unknown to it, and stays what it was.
    """
    places = dict(before.objects) if before else {}
    places.setdefault(name, ObjectPlace())
    date, inputs = made
    return Objects(
        date=date,
        tool=TOOL,
        inputs={**inputs, "lever_m": list(_row3(found.marker_m))},
        residuals={"rms_mm": _short(1e3 * found.rms_m), "points": len(found.residuals_m)},
        T_rig_from_lighthouse=_rows(found.T_rig_from_lighthouse),
        universe=universe,
        middle_m=_row3(middle_m),
        objects=places,
    )


def _rows(T: Array) -> Matrix4:
    # Nine digits: the turn is exact to a nanometre at 1 m.
    rows = [[round(value, 9) + 0.0 for value in row] for row in T.tolist()]
    return msgspec.convert(rows, Matrix4)


def _row3(values: Array) -> Row3:
    x, y, z = (round(v, 6) + 0.0 for v in np.asarray(values).tolist())
    return x, y, z


def _short(value: float) -> float:
    return float(f"{value:.4g}")
