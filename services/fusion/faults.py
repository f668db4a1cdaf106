"""What fusion finds wrong with cameras and markers, as conditions that begin and end.

Looked at once a second; time is an argument, and so is whether the session runs: a camera that was
told to stop is not silent.
"""

from __future__ import annotations

from collections import Counter

from rhot.files.config import RigConfig
from rhot.process.fault_log import FaultLog
from services.fusion.alignment.clock_alignment import Correction
from services.fusion.monitors.camera_arrivals import CameraArrivals
from services.fusion.monitors.markers_at_edge import at_edge_text
from services.fusion.monitors.unseen_markers import (
    unseen_action,
    unseen_hand_text,
    unseen_text,
)
from services.fusion.step import FusionStep

# Why frames are rejected (FusionStep.rejected) -> the fault's code, and what is wrong.
_REJECTED = {
    "unknown_camera": (
        "camera_unknown",
        "frames of camera {camera}, which rig.toml does not name, are ignored",
    ),
    "wrong_size": (
        "camera_wrong_size",
        "frames of camera {camera} have another size than {camera}.lens.json, and are ignored",
    ),
    "absurd_stamp": (
        "camera_clock_off",
        "frames of camera {camera} with an impossible stamp are ignored",
    ),
    "astray": (
        "camera_clock_off",
        (
            "the clock of camera {camera} is far off the others': its frames are ignored, since its"
            " clock offset is wrong or was set"
        ),
    ),
}
_CODES = sorted({code for code, _ in _REJECTED.values()})
Pair = tuple[str, str]


class FusionFaults:
    """Turns what a FusionStep counts and watches into the faults of its service."""

    def __init__(self, step: FusionStep, config: RigConfig, faults: FaultLog, now_s: float) -> None:
        """now_s: a monotonic clock."""
        self._step = step
        self._config = config
        self._faults = faults
        self._looked_s = now_s
        self._arrivals = CameraArrivals([camera.name for camera in config.camera], now_s)
        self._counted: tuple[Counter[str], Counter[Pair]] = Counter(), Counter()

    def look(self, now_s: float, *, session_running: bool) -> None:
        """Report what is wrong now and end what is over; to be called once a second."""
        step = self._step
        admitted = step.admitted - self._counted[0]
        rejected = step.rejected - self._counted[1]
        self._counted = Counter(step.admitted), Counter(step.rejected)
        self._arrivals.look(admitted, rejected, now_s, expected=session_running)
        self._report_rejected()
        self._report_silent(now_s)
        aligned = step.alignment.corrections
        self._faults.replace(
            "camera_clock_aligned", {name: _aligned_text(name, aligned[name]) for name in aligned}
        )
        moved, mirrored = step.clocks.moved_px, step.mirrors.mirrored
        self._faults.replace(
            "camera_moved", {_name(pair): _moved_text(pair, moved[pair]) for pair in moved}
        )
        self._faults.replace(
            "cameras_mirrored",
            {_name(pair): _mirrored_text(pair, mirrored[pair]) for pair in mirrored},
        )
        self._report_markers(now_s - self._looked_s)
        self._looked_s = now_s

    def _report_rejected(self) -> None:
        texts: dict[str, dict[str, str]] = {code: {} for code in _CODES}
        for reason, camera in self._arrivals.rejecting:
            if reason in _REJECTED:
                code, text = _REJECTED[reason]
                texts[code][camera] = text.format(camera=camera)
        for code, of_code in texts.items():
            self._faults.replace(code, of_code)

    def _report_silent(self, now_s: float) -> None:
        texts, actions = {}, {}
        for camera, silent_s in self._arrivals.silent_s(now_s).items():
            host = self._config.camera_named(camera).host or "this computer"
            repeats = ("twice", camera) in self._arrivals.rejecting
            what = "only the same frame again and again" if repeats else "no markers"
            texts[camera] = f"{what} from camera {camera} ({host}) for {silent_s:.0f} s"
            actions[camera] = (
                f"look at its tracker on {host}: `systemctl status rhot-pi-tracker@{camera}`"
            )
        self._faults.replace("camera_silent", texts, actions)

    def _report_markers(self, elapsed_s: float) -> None:
        markers, hands = self._step.unseen_markers.look(elapsed_s)
        texts = {
            self._color(one.landmark): unseen_text(one, self._marker(one.landmark))
            for one in markers
        }
        actions = {self._color(one.landmark): unseen_action(one.unseen_by) for one in markers}
        for hand in hands:
            subject = f"{hand.hand} hand"
            texts[subject] = unseen_hand_text(hand)
            actions[subject] = unseen_action(hand.unseen_by)
        self._faults.replace("marker_not_seen", texts, actions)
        at_edge = {
            one.camera: at_edge_text(
                one.camera, list(map(self._marker, one.landmarks)), one.seconds
            )
            for one in self._step.at_edge.look(elapsed_s)
        }
        self._faults.replace("marker_at_edge", at_edge)

    def _color(self, number: int) -> str:
        landmark = self._step.landmarks[number]
        return self._config.hand[landmark.hand].marker_names[landmark.name]

    def _marker(self, number: int) -> str:
        """What people call it: `lime (little tip)`, with the hand where there are two."""
        landmark = self._step.landmarks[number]
        hand = f"{landmark.hand} " if len(self._config.hand) > 1 else ""
        return f"{self._color(number)} ({hand}{landmark.name.replace('_', ' ')})"


def _name(pair: Pair) -> str:
    return f"{pair[0]} and {pair[1]}"


def _aligned_text(camera: str, found: Correction) -> str:
    late = "late" if found.late_s > 0.0 else "early"
    return (
        f"the stamps of camera {camera} are {1e3 * abs(found.late_s):.0f} ms {late} by the motion"
        f" of the hand, and claim {1e3 * found.claimed_sigma_s:.1f} ms: its markers are used with"
        " that taken off"
    )


def _moved_text(pair: Pair, height_px: float) -> str:
    return (
        f"the views of cameras {_name(pair)} differ by {height_px:.1f} px in height: one of them"
        " has moved since the calibration"
    )


def _mirrored_text(pair: Pair, axis: str) -> str:
    return (
        f"the views of cameras {_name(pair)} are mirror images of each other, {axis}: one of them"
        " has hflip or vflip set, or lost it, since the calibration"
    )
