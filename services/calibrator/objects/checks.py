"""Refusals of registrations: recordings that cannot determine them, results not to be trusted.
Pure.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rhot.errors import CalibrationError
from services.calibrator.objects.coverage import (
    MIN_INSTANTS,
    MIN_SECOND_M,
    MIN_SECONDS,
    MIN_THIRD_M,
    MIN_TURN_RAD,
    coverage,
)
from services.calibrator.objects.result import ObjectRegistration
from services.calibrator.objects.sightings import Sightings
from services.calibrator.objects.start import MAX_LATE_S, Located, Start, carried, find_start
from services.calibrator.objects.tracker_path import TrackerPath

# A camera that saw the paint less often than this took no part.
_MIN_SIGHTINGS = 40
# What the start leaves in the median, m: 5 mm for sound data at 1 m, several cm where paint and
# tracker are not of one thing. Another tracker is the one if it leaves under half.
_MAX_MISS_M, _MUCH_BETTER = 0.04, 0.5
# Of the sightings, those that must agree with the result: 59 % do where a spot of the paint's
# colour is always in view of one of two cameras and poses go astray for 2 s of 20; it is right.
_MIN_INLIERS = 0.4
# Standard deviations beyond which objects would not sit in the hand: m, rad, ms.
_MAX_SIGMA_M, _MAX_SIGMA_RAD, _MAX_SIGMA_MS = 0.003, 0.009, 3.0
# What the fit may leave, mm, and by how much more on seconds left out.
_MAX_RESIDUAL_MM, _MAX_HELD_OUT = 6.0, 1.8


def check_sightings(seen: Mapping[str, Sightings], paths: Mapping[str, TrackerPath]) -> None:
    """Raises CalibrationError if a tracker or its paint was not seen, or by one camera only."""
    if not seen:
        raise CalibrationError(
            "no tracker with paint: give an [[object]] of rig.toml its `marker`, a colour"
        )
    for serial, sightings in seen.items():
        path = paths.get(serial)
        if path is None or len(path) < MIN_INSTANTS:
            count = 0 if path is None else len(path)
            others = sorted(name for name, other in paths.items() if len(other) >= MIN_INSTANTS)
            raise CalibrationError(
                f"tracker {serial} was tracked {count} times only, {MIN_INSTANTS} are needed: is "
                "it switched on, and do the base stations see it? Tracked were: "
                f"{', '.join(others) or 'none'}"
            )
        _check_cameras(sightings)
    universes = {paths[serial].universe for serial in seen}
    if len(universes) > 1:
        raise CalibrationError(
            f"the trackers are in different universes ({', '.join(sorted(universes))}): all must "
            "be of one SteamVR, after one room setup"
        )


def _check_cameras(seen: Sightings) -> None:
    if not len(seen):
        raise CalibrationError(
            f"no camera saw {seen.color!r} paint: turn the dab to the cameras, and see with "
            "`rhot check` that its colour is found"
        )
    counts = np.bincount(seen.camera, minlength=len(seen.cameras))
    if np.sum(counts >= _MIN_SIGHTINGS) < 2:
        told = ", ".join(
            f"{c.name} {count}" for c, count in zip(seen.cameras, counts.tolist(), strict=True)
        )
        raise CalibrationError(
            f"two cameras must see the {seen.color!r} paint, each {_MIN_SIGHTINGS} times at least "
            f"({told}): keep the tracker where the views overlap, the dab towards the cameras"
        )


def check_start(
    seen: Mapping[str, Sightings],
    paths: Mapping[str, TrackerPath],
    located: Mapping[str, Located],
    starts: Mapping[str, Start | None],
) -> None:
    """Raises CalibrationError if the motion is too little, or not of the same thing."""
    for serial, sightings in seen.items():
        start = starts[serial]
        if start is None:
            raise CalibrationError(
                f"tracker {serial} and its {sightings.color!r} paint were hardly seen at the same "
                f"time (paint located at {len(located[serial].stamps_ns)} instants): keep both "
                "base stations and two cameras in sight of it, for 20 s"
            )
        _check_motion(serial, paths[serial], located[serial], start)
        _check_match(serial, sightings, paths, located[serial], start)


def _check_motion(serial: str, path: TrackerPath, located: Located, start: Start) -> None:
    motion = path.motion(located.stamps_ns, start.late_s)
    known = motion.known
    covered = coverage(
        located.stamps_ns[known],
        carried(motion, start.marker_m)[known],
        motion.rotation[known],
    )
    if covered.seconds < MIN_SECONDS or covered.instants < MIN_INSTANTS:
        raise CalibrationError(
            f"tracker {serial} was seen by two cameras and the lighthouses together for "
            f"{covered.seconds:.0f} s ({covered.instants} instants); {MIN_SECONDS:.0f} s and "
            f"{MIN_INSTANTS} are needed: record 20 s"
        )
    if covered.turn_rad < MIN_TURN_RAD:
        raise CalibrationError(
            f"tracker {serial} was turned about one axis only, or not at all "
            f"({np.degrees(covered.turn_rad):.0f} deg about a second axis, "
            f"{np.degrees(MIN_TURN_RAD):.0f} are needed): tilt it forwards and sideways too, by 30 "
            "deg each way, while you move it"
        )
    first, second, third = (100.0 * covered.extent_m).tolist()
    if covered.extent_m[1] < MIN_SECOND_M or covered.extent_m[2] < MIN_THIRD_M:
        form = "on a line" if covered.extent_m[1] < MIN_SECOND_M else "in a plane"
        raise CalibrationError(
            f"tracker {serial} was moved {form} ({first:.0f} x {second:.0f} x {third:.0f} cm; the "
            f"second and third must be {100 * MIN_SECOND_M:.0f} and {100 * MIN_THIRD_M:.0f} cm at "
            "least): move it left and right, up and down, nearer and farther"
        )


def _check_match(
    serial: str,
    seen: Sightings,
    paths: Mapping[str, TrackerPath],
    located: Located,
    start: Start,
) -> None:
    if start.miss_m <= _MAX_MISS_M and abs(start.late_s) < MAX_LATE_S:
        return
    for other, path in paths.items():
        if other == serial:
            continue
        guess = find_start(located, path)
        if guess is not None and guess.miss_m < min(_MUCH_BETTER * start.miss_m, _MAX_MISS_M):
            raise CalibrationError(
                f"the {seen.color!r} paint is on tracker {other}, not on {serial}: correct the "
                "serials in rig.toml, or exchange the trackers"
            )
    raise CalibrationError(
        f"the {seen.color!r} paint does not move as tracker {serial} does (they differ by "
        f"{1e3 * start.miss_m:.0f} mm, whatever the delay up to {MAX_LATE_S:g} s): is the paint on "
        "this tracker, is no other thing of that colour in view, does the clock of the machine "
        "with SteamVR agree?"
    )


def check_result(found: ObjectRegistration) -> None:
    """Raises CalibrationError if the result is uncertain or does not explain what was seen."""
    total = found.inliers + found.rejected
    if found.inliers < _MIN_INLIERS * total:
        raise CalibrationError(
            f"only {found.inliers} of {total} sightings agree with any registration: see that "
            "nothing else has the paint's colour, and that the lighthouses see the tracker"
        )
    if not found.residual.mm <= _MAX_RESIDUAL_MM:
        raise CalibrationError(
            f"the best registration leaves {found.residual.mm:.1f} mm "
            f"({found.residual.px:.1f} px), limit {_MAX_RESIDUAL_MM:g}: is the rig calibrated "
            "(`rhot calibrate stereo`), does nothing reflect or hide the base stations?"
        )
    late_ms = max(1e-6 * place.time_offset_sigma_ns for place in found.trackers.values())
    if found.sigma_m > _MAX_SIGMA_M or found.sigma_rad > _MAX_SIGMA_RAD or late_ms > _MAX_SIGMA_MS:
        raise CalibrationError(
            f"the registration stays uncertain by {1e3 * found.sigma_m:.1f} mm, "
            f"{np.degrees(found.sigma_rad):.2f} deg and {late_ms:.1f} ms (limits "
            f"{1e3 * _MAX_SIGMA_M:g} mm, {np.degrees(_MAX_SIGMA_RAD):.1f} deg, {_MAX_SIGMA_MS:g} "
            "ms): record longer, move faster and farther, nearer to the cameras, and turn more"
        )
    if not found.held_out.px <= _MAX_HELD_OUT * found.residual.px + 0.1:
        raise CalibrationError(
            f"seconds left out of the fit disagree by {found.held_out.px:.2f} px, those in it by "
            f"{found.residual.px:.2f}: the recording does not determine the registration; record "
            "longer, over the whole volume, and let nothing move but the tracker"
        )
