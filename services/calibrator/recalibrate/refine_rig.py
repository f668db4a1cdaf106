"""`rhot calibrate refine`: the cameras' extrinsics refined from moving markers. Pure.

Self-calibration: the markers are those of a painted hand, or of a wand, which is two markers a
known length apart, as in motion capture. The wand gives the scale; without one the distance of the
second camera from the first is kept. The first camera stays where it is, lenses are not touched;
the delay of each other camera's stamps is unknown too. Recordings that cannot determine the
extrinsics, and results that are no better on held-out seconds, are refused with a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, inverse
from services.calibrator.recalibrate.bundle import ExtrinsicsSolution, solve
from services.calibrator.recalibrate.checks import check_recording, check_result
from services.calibrator.recalibrate.held_out import held_out_errors
from services.calibrator.recalibrate.marker_tracks import MarkerTracks
from services.calibrator.recalibrate.residuals import ExtrinsicsProblem, WandEnds

# More points than this gain nothing for the time they cost: 3000 give a rotation to .004 deg.
_MAX_POINTS = 3000
# A wand shorter than its markers are wide gives no scale; a longer one is given in another unit.
_MIN_WAND_M, _MAX_WAND_M = 0.02, 2.0


@dataclass(frozen=True)
class Wand:
    """Two colours whose centres are length_m apart, as measured."""

    first: str
    second: str
    length_m: float


@dataclass(frozen=True, eq=False)
class ExtrinsicsChange:
    """What became of one camera, with standard deviations.

    A rotation about its own x, y, z and a shift in the rig frame, each (3,); its stamps are late by
    delay_ms.
    """

    rotation_deg: Array
    rotation_sigma_deg: Array
    shift_mm: Array
    shift_sigma_mm: Array
    delay_ms: float


@dataclass(frozen=True, eq=False)
class RefinedRig:
    """All cameras with refined T_rig_from_camera, what changed, and errors on held-out seconds.

    epipolar_before_px and epipolar_px are those of the old and of the refined extrinsics; wand_mm
    is the error of the wand's length before and after, None without a wand. All are robust RMS.
    """

    cameras: dict[str, Camera]
    changes: dict[str, ExtrinsicsChange]
    points: int
    seconds: float
    epipolar_before_px: float
    epipolar_px: float
    wand_mm: tuple[float, float] | None


def refine_rig(
    tracks: MarkerTracks, cameras: Mapping[str, Camera], wand: Wand | None = None
) -> RefinedRig:
    """Refine the extrinsics of all cameras but the first from a recording of moving markers.

    Raises CalibrationError, with the reason, if the recording cannot determine them or the result
    is not to be trusted.
    """
    ends = None if wand is None else _wand_ends(tracks, wand)
    step = max(1, len(tracks.instants_s) * len(tracks.colors) // _MAX_POINTS)
    tracks = replace(tracks, instants_s=tracks.instants_s[::step])
    in_order = list(cameras.values())
    problem = ExtrinsicsProblem(
        T_camera_from_rig=np.stack([camera.T_camera_from_rig for camera in in_order]),
        focals_px=np.array([float(np.mean(camera.focal_px)) for camera in in_order]),
        tracks=tracks,
        wand=ends,
    )
    old = solve(problem, delays_only=True)
    points = check_recording(problem, old, in_order[0])
    new = solve(problem)
    errors = held_out_errors(problem)
    check_result(in_order, new, errors)
    before_px, after_px = errors.epipolar_px
    return RefinedRig(
        cameras={
            name: replace(camera, T_rig_from_camera=inverse(new.T_camera_from_rig[c]))
            for c, (name, camera) in enumerate(cameras.items())
        },
        changes={name: _change(new, row) for row, name in enumerate(list(cameras)[1:])},
        points=points,
        seconds=float(np.ptp(tracks.instants_s)),
        epipolar_before_px=before_px,
        epipolar_px=after_px,
        wand_mm=errors.wand_mm,
    )


def _wand_ends(tracks: MarkerTracks, wand: Wand) -> WandEnds:
    recorded = {wand.first, wand.second} <= set(tracks.colors)
    two_colors = wand.first != wand.second
    if not (recorded and two_colors and _MIN_WAND_M <= wand.length_m <= _MAX_WAND_M):
        raise CalibrationError(
            f"wand {wand.first},{wand.second}={wand.length_m:g} cannot be used: give two different "
            f"colours of those recorded ({', '.join(tracks.colors) or 'none'}) and the distance of "
            f"their centres in metres, {_MIN_WAND_M:g}..{_MAX_WAND_M:g}, e.g. blue,green=0.2"
        )
    first, second = (tracks.colors.index(color) for color in (wand.first, wand.second))
    return WandEnds(first, second, wand.length_m)


def _change(new: ExtrinsicsSolution, row: int) -> ExtrinsicsChange:
    x, sigma = new.x[row], new.sigma[row]
    return ExtrinsicsChange(
        rotation_deg=np.degrees(x[:3]),
        rotation_sigma_deg=np.degrees(sigma[:3]),
        shift_mm=1e3 * x[3:6],
        shift_sigma_mm=1e3 * sigma[3:6],
        delay_ms=1e3 * float(x[6]),
    )
