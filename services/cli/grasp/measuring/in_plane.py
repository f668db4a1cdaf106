"""`rhot grasp measure --reference`: joints in pixels become millimetres of the finger's plane, with
what the plane's own uncertainty adds to every angle and length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import msgspec
import numpy as np

from rhot.errors import CaptureError
from services.pi_tracker.image.yuv_planes import bgr_image
from studies.grasp.measure.joints import Finger, Place, Seen
from studies.grasp.measure.pictures import Pictures, corrected_seeds
from studies.grasp.measure.recordings import Finding, Line, Wanted, with_base
from studies.grasp.metrology.finger import finger_in_plane, points_in_plane
from studies.grasp.metrology.plane import Plane
from studies.grasp.metrology.reference import Known, parse_reference, plane_of
from studies.grasp.recording import ANGLES, JOINTS, GraspRecording


def reference_of(text: str, pictures: Pictures) -> Known:
    """The plane of a reference, at pixels of the first picture as the camera saw it."""
    reference = parse_reference(text)
    clicks = {f"reference {n + 1}": (x, y) for n, (x, y) in enumerate(reference.points_px)}
    corrected = np.array(list(corrected_seeds(clicks, pictures.lens).values()))
    first = pictures.first()
    return plane_of(
        reference._replace(points_px=corrected),
        first.size_px,
        matrix=pictures.matrix(),
        picture=bgr_image(first),
    )


def in_plane(
    known: Known,
    pictures: Sequence[Seen],
    wanted: Wanted,
    recorded: Callable[[list[Seen], Wanted], dict[Finger, Finding]],
) -> dict[Finger, Finding]:
    """What recorded makes of the pictures, in mm of the plane."""
    if wanted.mm_per_px is not None or wanted.lengths_mm:
        raise CaptureError(
            "--reference, --length and --scale-mm-per-px each say how long things are; give one"
        )
    plane = known.plane
    seen = [with_base(picture, wanted.base) for picture in pictures]
    base: Line | None = None
    if wanted.base is not None:
        (x0, y0), (x1, y1) = plane.to_mm(np.reshape(wanted.base, (2, 2))).tolist()
        base = (x0, y0, x1, y1)
    try:
        found = recorded(
            [placed(plane, one) for one in seen], replace(wanted, base=base, mm_per_px=1.0)
        )
    except CaptureError as error:
        # Who gave a reference never heard of that scale.
        raise CaptureError(str(error).replace("--scale-mm-per-px 1:", "--reference:")) from None
    return {finger: _with_sigmas(known, finding, seen) for finger, finding in found.items()}


def placed(plane: Plane, seen: Seen) -> Seen:
    """One picture's places in mm of the plane, each with its own noise."""
    if not seen.places:
        return seen
    px = np.array([(place.x_px, place.y_px) for place in seen.places.values()])
    sigma = np.array([place.sigma_px for place in seen.places.values()])
    found = points_in_plane(plane, px, sigma)
    places = {
        name: Place(float(x), float(y), float(own), place.quality)
        for (name, place), (x, y), own in zip(
            seen.places.items(), found.points_mm, found.sigma_mm, strict=True
        )
    }
    return seen._replace(places=places)


def _with_sigmas(known: Known, finding: Finding, pictures: Sequence[Seen]) -> Finding:
    """Angles' and lengths' sigmas with the plane's share, where all places were seen."""
    plan, recording = finding
    notes = [*recording.notes, known.about()]
    recording = msgspec.structs.replace(recording, notes=notes)
    finding = Finding(plan, recording)
    if plan.base is None or set(plan.joints) != set(JOINTS):
        return finding
    names = [*plan.base, *plan.joints.values()]
    whole = [n for n, seen in enumerate(pictures) if set(names) <= set(seen.places)]
    if not whole:
        return finding
    places = [[pictures[n].places[name] for name in names] for n in whole]
    px = np.array([[(place.x_px, place.y_px) for place in row] for row in places])
    sigma = np.array([[place.sigma_px for place in row] for row in places])
    joined = plan.base.end == plan.joints["mcp"]
    measured = finger_in_plane(known.plane, px, sigma, base_to_mcp=joined)
    frames = list(recording.frames)
    for n, sigmas in zip(whole, measured.angles_sigma_rad, strict=True):
        told = dict(zip(ANGLES, np.round(sigmas, 6).tolist(), strict=True))
        frames[n] = msgspec.structs.replace(frames[n], angles_sigma_rad=told)
    return finding._replace(recording=_with_lengths(recording, measured.plane_sigma, frames))


def _with_lengths(
    recording: GraspRecording, plane_sigma: np.ndarray, frames: list
) -> GraspRecording:
    """The recording with these frames; its lengths' sigmas with the plane's (n, 6) share."""
    sigmas = recording.lengths_sigma
    if sigmas is not None:
        share = np.median(plane_sigma[:, 3:], axis=0)
        whole = [round(float(one), 4) for one in np.hypot(sigmas, share)]
        sigmas = (whole[0], whole[1], whole[2])
    return msgspec.structs.replace(recording, frames=frames, lengths_sigma=sigmas)
