"""Fusion's own figures for health, renewed once a second."""

from __future__ import annotations

from services.fusion.step import FusionStep


class HealthFigures:
    """What a FusionStep's counters say, for a service's `values`."""

    def __init__(self, step: FusionStep, values: dict[str, float], now_s: float) -> None:
        """values is written in place. now_s: a monotonic clock."""
        self._step = step
        self._values = values
        self._renewed_s = now_s
        self._accepted = 0
        self._busy_s: list[float] = []

    def note_frame(self, busy_s: float) -> None:
        """One frame took that long."""
        self._busy_s.append(busy_s)

    def renew(self, now_s: float) -> None:
        """Write the figures since the last time; to be called once a second."""
        step, values = self._step, self._values
        counts = step.method.counts
        elapsed_s = max(now_s - self._renewed_s, 1e-3)
        values["observations_hz"] = (counts.accepted - self._accepted) / elapsed_s
        if self._busy_s:
            values["step_p50_us"] = 1e6 * sorted(self._busy_s)[len(self._busy_s) // 2]
        values["epipolar_px"] = step.clocks.epipolar_px
        values["moved_pairs"] = float(len(step.clocks.moved_px))
        values["frames_unlearned"] = float(step.unlearned)
        values["late_poses"] = float(step.late_poses)
        values["mirrored_pairs"] = float(len(step.mirrors.mirrored))
        for camera, late_s in step.clocks.late_s.items():
            values[f"late_{camera}_ms"] = 1e3 * late_s
        for (first, second), height_px in step.clocks.heights_px.items():
            values[f"height_{first}_{second}_px"] = height_px
        for name in ("gated", "late", "refused", "started", "dropped", "incoherent"):
            values[name] = float(getattr(counts, name))
        for reason, count in step.refusals.items():
            values[f"frames_{reason}"] = float(count)
        self._renewed_s = now_s
        self._accepted = counts.accepted
        self._busy_s.clear()
