"""Fusion's own figures for health, renewed once a second, and its errors, each reported once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from services.fusion.step import FusionStep

_RENEW_S = 1.0
_REFUSAL_TEXTS = {
    "unknown_camera": "frames of a camera that rig.toml does not name are ignored",
    "wrong_size": (
        "frames of another size than <camera>.lens.json are ignored; calibrate that camera at the "
        "size it runs at"
    ),
    "absurd_stamp": "frames with an impossible stamp are ignored",
    "astray": (
        "frames whose clock is far off the others' are ignored; the camera's clock offset is wrong "
        "or was set"
    ),
}
Pair = tuple[str, str]


class HealthFigures:
    """What a FusionStep's counters say, for a service's `values` and `error`."""

    def __init__(
        self,
        step: FusionStep,
        values: dict[str, float],
        error: Callable[[str], None],
        now_s: float,
    ) -> None:
        """values is written in place; error takes a text for the user. now_s: a monotonic clock."""
        self._step = step
        self._values = values
        self._error = error
        self._renewed_s = now_s
        self._accepted = 0
        self._busy_s: list[float] = []
        self._reported_refusals: set[str] = set()
        self._reported_pairs: dict[str, set[Pair]] = defaultdict(set)

    def note_frame(self, busy_s: float, now_s: float) -> None:
        """One frame took that long."""
        self._busy_s.append(busy_s)
        for reason in self._step.refusals.keys() - self._reported_refusals:
            self._reported_refusals.add(reason)
            if reason in _REFUSAL_TEXTS:
                self._error(_REFUSAL_TEXTS[reason])
        if now_s - self._renewed_s >= _RENEW_S:
            self._renew(now_s - self._renewed_s)
            self._renewed_s = now_s

    def _renew(self, elapsed_s: float) -> None:
        step, values = self._step, self._values
        counts = step.method.counts
        values["observations_hz"] = (counts.accepted - self._accepted) / elapsed_s
        values["step_p50_us"] = 1e6 * sorted(self._busy_s)[len(self._busy_s) // 2]
        values["epipolar_px"] = step.clocks.epipolar_px
        moved, mirrored = step.clocks.moved_px, step.mirrors.mirrored
        self._report_pairs("moved_pairs", {pair: _moved_text(pair, moved[pair]) for pair in moved})
        self._report_pairs(
            "mirrored_pairs", {pair: _mirrored_text(pair, mirrored[pair]) for pair in mirrored}
        )
        for camera, late_s in step.clocks.late_s.items():
            values[f"late_{camera}_ms"] = 1e3 * late_s
        for pair, height_px in step.clocks.heights_px.items():
            values[f"height_{pair}_px"] = height_px
        for name in ("gated", "late", "refused", "started", "dropped", "incoherent"):
            values[name] = float(getattr(counts, name))
        for reason, count in step.refusals.items():
            values[f"frames_{reason}"] = float(count)
        self._accepted = counts.accepted
        self._busy_s.clear()

    def _report_pairs(self, name: str, errors: dict[Pair, str]) -> None:
        """Report pairs of cameras when they show an error, and again when it comes back."""
        for pair in errors.keys() - self._reported_pairs[name]:
            self._error(errors[pair])
        self._reported_pairs[name] = set(errors)
        self._values[name] = float(len(errors))


def _moved_text(pair: Pair, height_px: float) -> str:
    return (
        f"the views of cameras {pair[0]} and {pair[1]} differ by {height_px:.1f} px in height: one "
        f"of them has moved since the calibration; fasten it and run `rhot calibrate stereo`"
    )


def _mirrored_text(pair: Pair, axis: str) -> str:
    return (
        f"the views of cameras {pair[0]} and {pair[1]} are mirror images of each other, {axis}: "
        "one of them has hflip or vflip set, or lost it, since the calibration; "
        "set both as they were then"
    )
