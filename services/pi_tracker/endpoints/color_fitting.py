"""Fits colour ranges to paint that somebody points at in this camera's pictures.

The pictures stay here, and the tracker keeps its ranges: a fit is a proposal. What is asked for
wrongly, or points at a picture that is gone, gets an answer with the reason.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import msgspec

from rhot import topics
from rhot.errors import UNDECODABLE, CalibrationError
from rhot.files.calibration import ColorRange, Colors
from rhot.files.config import RigConfig
from rhot.messages.camera import FitRequest, FitResult, Patch
from rhot.process.service import Service
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.colors.proposal.propose import boxes_of, for_markers, propose
from services.pi_tracker.colors.report import examine, statistics
from services.pi_tracker.endpoints.picture_cache import PictureCache
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.tracker import CameraTracker

# One is at work, and each takes a second or two; who would wait longer has gone by then.
_MOST_WAITING = 3


class ColorFitting:
    """Answers fit requests with the pictures of a cache."""

    def __init__(self, service: Service, pictures: PictureCache, tracker: CameraTracker) -> None:
        self._pictures, self._tracker = pictures, tracker
        self._rig = service.config
        # One at a time: it takes most of a Pi's core for a second, beside the tracker.
        self._lock = asyncio.Lock()
        self._asked = 0
        service.bus.answer_requests(topics.FIT, self._answer, camera=service.instance)

    async def _answer(self, payload: bytes) -> FitResult:
        if self._asked > _MOST_WAITING:
            return FitResult(
                error=f"{_MOST_WAITING} others wait already for this camera's fit; ask again later"
            )
        self._asked += 1
        try:
            return await self._fit(payload)
        finally:
            self._asked -= 1

    async def _fit(self, payload: bytes) -> FitResult:
        try:
            request = msgspec.json.decode(payload, type=FitRequest)
            names = list(
                dict.fromkeys([one.picture for one in request.pointed] + list(request.pictures))
            )
            if request.auto:
                # Large sensors have fewer of a hand in motion; the others tell enough.
                names = [name for name in names if self._pictures.has(name)] or names[-1:]
            frames = [self._pictures.frame(name) for name in names]
            async with self._lock:
                return await asyncio.to_thread(
                    answer, request, names, frames, self._rig, self._tracker.colors
                )
        except (*UNDECODABLE, CalibrationError) as error:
            return FitResult(error=str(error))


def answer(
    request: FitRequest,
    names: list[str],
    frames: Sequence[Frame],
    rig: RigConfig,
    current: Colors,
) -> FitResult:
    """The result of a request on pictures of these names; raises CalibrationError."""
    notes: list[str] = []
    if request.auto:
        pointers = _proposed(frames, rig, notes)
    else:
        pointers = [
            Pointer(p.color, names.index(p.picture), p.x_px, p.y_px, p.width_px, p.height_px)
            for p in request.pointed
        ]
    study = gather(frames, pointers)
    fitted = fit(study.samples)
    known: dict[str, ColorRange] = {
        name: span for name, span in current.colors.items() if name not in fitted
    }
    report = examine(study, fitted, known)
    patches = [
        Patch(color=color, picture=names[patch.frame], box_px=patch.box_px)
        for color, samples in study.samples.items()
        for patch in samples.patches
    ]
    return FitResult(
        colors=fitted,
        patches=patches,
        residuals=statistics(report),
        warnings=list(report.warnings),
        notes=study.notes + notes,
    )


def _proposed(frames: Sequence[Frame], rig: RigConfig, notes: list[str]) -> list[Pointer]:
    """Boxes around what may be paint: a room's colours are no ranges to part the paints from.

    Adds to the notes what was not found, and which paints would stand out besides.
    """
    proposals, suggestions = propose(frames, rig.colors, rig.landmarks)
    chosen, missing = for_markers(proposals, rig.colors)
    if not proposals:
        raise CalibrationError("no patch of saturated colour stands out in these pictures")
    if not chosen:
        raise CalibrationError(
            f"nothing that stands out in these pictures may be {', '.join(missing)} of rig.toml's "
            "markers; click on them"
        )
    if missing:
        notes.append(f"no patch was found that could be {', '.join(missing)}: click there")
    if suggestions:
        notes.append(
            "further paints that would stand out: " + ", ".join(one.color for one in suggestions)
        )
    return boxes_of(chosen)
