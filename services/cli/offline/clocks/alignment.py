"""The clocks of all cameras from the markers of a whole recording, and frames put right by them.

Videos without a common clock are aligned by whatever is found, of motion that repeats itself by the
likeliest of what fits. Stamps of one clock are believed as long as they contradict the markers by
no more than fusion learns by itself as it goes; beyond, the markers' motion outweighs them. Nothing
changes in frames that are believed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import msgspec

from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame
from services.cli.offline.clocks.camera_clock import CameraClock, Verdict, warnings_of
from services.cli.offline.clocks.recorded_markers import RecordedMarkers
from services.fusion.alignment.clock_line import ClockLine, LineFit
from services.fusion.alignment.recorded_offset import (
    RANGE_S,
    RecordedOffset,
    find_recorded_offset,
    undecided,
)
from services.fusion.geometry.rectified_pair import rectified_pair

# Stamps of one clock are believed while the markers differ from them by less than this: the live
# tuner of clocks reaches as far (services/fusion/alignment/clock_alignment.py).
_REACH_S, _SIGMAS = 15e-3, 4.0
# No clock that was put right is announced as better known than this: what the exposure's middle and
# markers' own errors leave.
_SIGMA_FLOOR_S = 1e-4
_UNCALIBRATED = "the cameras are not calibrated together"


class Clocks:
    """By camera, the line that its clock is put right by; cameras without one are believed."""

    def __init__(self, recorded: RecordedMarkers, cameras: Sequence[str]) -> None:
        """cameras: the first is the reference."""
        self.told: list[CameraClock] = []
        self._recorded = recorded
        self._reference = cameras[0]
        self._epoch_ns = recorded.span_ns(cameras[0])[0]
        # None: how well the clock is known is not known.
        self._lines: dict[str, tuple[ClockLine, LineFit | None]] = {}
        self._moved_ns = 0

    def find(
        self,
        cameras: Mapping[str, Camera] | None,
        names: Sequence[str],
        by_hand: Mapping[str, float],
        *,
        tune: bool,
    ) -> None:
        """Compare all cameras with the first, or with one that was compared with it.

        cameras None, if they are not calibrated together. tune: whether known clocks may be put
        right.
        """
        known = [self._reference]
        for name in names[1:]:
            found, against, focal_px = undecided(_UNCALIBRATED), self._reference, 1.0
            for other in known if cameras is not None else []:
                fresh, focal = self._compare(cameras or {}, other, name)
                if other == self._reference or fresh.decided:
                    found, against, focal_px = fresh, other, focal
                if found.decided:
                    break
            if found.decided:
                known.append(name)
            self._judge(name, against, found, focal_px, by_hand.get(name), tune=tune)
        starts = [self._put_right_ns(name, self._recorded.span_ns(name)[0]) for name in names]
        self._moved_ns = max(0, -min(starts)) if self._lines else 0

    @property
    def total(self) -> int:
        """How many frames there are."""
        return len(self._recorded)

    @property
    def worth_telling(self) -> bool:
        """Whether any clock is not simply believed."""
        return any(one.verdict != "as stamped" for one in self.told)

    @property
    def warnings(self) -> list[str]:
        """What a person must know."""
        return [text for one in self.told for text in warnings_of(one)]

    def frames(self) -> Iterator[MarkerFrame]:
        """All frames: as they came, or put right and in the order of their right instants."""
        if not self._lines:
            yield from self._recorded.frames()
            return
        for frame in self._recorded.frames(self._put_right_ns):
            yield self._put_right(frame)

    def _put_right(self, frame: MarkerFrame) -> MarkerFrame:
        own_ns = frame.stamp_ns - frame.clock_offset_ns
        right_ns = self._put_right_ns(frame.camera, own_ns)
        late_ns = own_ns - right_ns - self._moved_ns
        sigma_ns = frame.clock_sigma_ns
        if frame.camera in self._lines:
            fit = self._lines[frame.camera][1]
            if fit is not None:
                sigma_s = fit.sigma_s((right_ns - self._epoch_ns) * 1e-9)
                sigma_ns = round(1e9 * math.hypot(sigma_s, _SIGMA_FLOOR_S))
        elif frame.camera == self._reference and self._known():
            sigma_ns = round(1e9 * _SIGMA_FLOOR_S)
        return msgspec.structs.replace(
            frame, clock_offset_ns=frame.clock_offset_ns + late_ns, clock_sigma_ns=sigma_ns
        )

    def _known(self) -> bool:
        """Whether the reference's clock counts as known: others are measured against it."""
        measured = any(fit is not None for _, fit in self._lines.values())
        return measured and self._recorded.unknown(self._reference)

    def _put_right_ns(self, camera: str, own_ns: int) -> int:
        """The reference's clock at an instant of a camera's."""
        if camera not in self._lines:
            return own_ns
        line = self._lines[camera][0]
        since_s = (own_ns - self._epoch_ns) * 1e-9
        late_s = since_s - line.first_s(since_s)
        return own_ns - round(1e9 * late_s)

    def _compare(
        self, cameras: Mapping[str, Camera], first: str, second: str
    ) -> tuple[RecordedOffset, float]:
        """What the markers tell of two cameras, and the focal length that residuals are told in."""
        pair = rectified_pair(cameras[first], cameras[second])
        if pair is None:
            return undecided("the two cameras look along the line between them"), 1.0
        heights, epoch_ns = self._recorded.heights, self._epoch_ns
        one = heights(cameras[first], pair.R_rectified_from_first, epoch_ns)
        other = self._recorded.heights(
            cameras[second], pair.R_rectified_from_second, self._epoch_ns
        )
        both = sorted(one.keys() & other.keys())
        found = find_recorded_offset([one[color] for color in both], [other[c] for c in both])
        return found, pair.focal_px

    def _judge(
        self,
        name: str,
        against: str,
        found: RecordedOffset,
        focal_px: float,
        by_hand: float | None,
        *,
        tune: bool,
    ) -> None:
        """Decide what a camera's frames are put right by, and write down why."""
        line = found.fit.line
        verdict: Verdict = "as stamped"
        used = ClockLine(0.0, 0.0, line.at_s)
        unknown = self._recorded.unknown(name) or self._recorded.unknown(against)
        beyond = self._most_s(name, line) > max(_REACH_S, _SIGMAS * found.fit.offset_sigma_s)
        if by_hand is not None:
            verdict, used = "by hand", ClockLine(by_hand, 0.0, 0.0)
            self._lines[name] = (used, None)
        elif found.decided and (unknown or (beyond and tune)):
            verdict, used = "aligned" if unknown else "corrected", line
            self._lines[name] = self._through(against, found.fit)
        elif found.repeats and unknown:
            verdict, used = "likeliest", line
            self._lines[name] = self._through(against, found.fit)
        elif found.decided and beyond:
            verdict = "contradicted"
        elif unknown:
            verdict = "unknown"
        self.told.append(_told(name, against, verdict, used, found, focal_px))

    def _through(self, against: str, fit: LineFit) -> tuple[ClockLine, LineFit]:
        """A camera's line against the reference, from that against another camera."""
        if against not in self._lines:
            return fit.line, fit
        first, known = self._lines[against]
        at_s = first.first_s(fit.line.at_s)
        line = ClockLine(first.late_s(at_s) + fit.line.offset_s, first.drift + fit.line.drift, at_s)
        sigma_s = 0.0 if known is None else known.sigma_s(at_s)
        drift = 0.0 if known is None else known.drift_sigma
        both = fit._replace(
            line=line,
            offset_sigma_s=math.hypot(fit.offset_sigma_s, sigma_s),
            drift_sigma=math.hypot(fit.drift_sigma, drift),
        )
        return line, both

    def _most_s(self, name: str, line: ClockLine) -> float:
        """The most that a line is off 0 within a camera's recording."""
        ends = self._recorded.span_ns(name)
        return max(abs(line.late_s((end - self._epoch_ns) * 1e-9)) for end in ends)


def _told(
    name: str,
    against: str,
    verdict: Verdict,
    used: ClockLine,
    found: RecordedOffset,
    focal_px: float,
) -> CameraClock:
    fit = found.fit
    if math.isinf(fit.offset_sigma_s):
        return CameraClock(
            camera=name,
            against=against,
            verdict=verdict,
            used_offset_s=used.offset_s,
            found=False,
            range_s=RANGE_S,
            why_not=found.why_not,
        )
    second = not math.isnan(found.second_s)
    return CameraClock(
        camera=name,
        against=against,
        verdict=verdict,
        used_offset_s=round(used.offset_s, 7),
        used_drift_ppm=round(1e6 * used.drift, 3),
        found=found.decided,
        range_s=RANGE_S,
        why_not=found.why_not,
        offset_s=round(fit.line.offset_s, 7),
        offset_sigma_s=round(fit.offset_sigma_s, 7),
        at_s=round(fit.line.at_s, 3),
        offset_at_start_s=round(fit.line.late_s(0.0), 7),
        drift_ppm=round(1e6 * fit.line.drift, 3),
        drift_sigma_ppm=round(1e6 * fit.drift_sigma, 3),
        residual_px=round(found.residual * focal_px, 4),
        wander_s=round(fit.wander_s, 6),
        second_offset_s=round(found.second_s, 4) if second else None,
        second_residual_px=round(found.second_residual * focal_px, 4) if second else None,
        better=round(found.better, 1),
    )
