"""Every condition that a rig knows to be wrong: a stable code, what it means, what to do.

One list for the journal, `rhot top`, `rhot doctor`, the page and Health: who finds a condition
gives its code and the particulars, and the words for everything else stand here. Pure.
docs/guide/troubleshooting.md has a section for each code.
"""

from __future__ import annotations

from dataclasses import dataclass

from rhot.errors import RhotError
from rhot.health_messages import Severity


@dataclass(frozen=True)
class FaultKind:
    """What one code means.

    error: no pose, or a wrong one, as long as it lasts; warning: it works, but worse or not for
    long. action may name {subject}, which is filled in.
    """

    code: str
    severity: Severity
    meaning: str
    action: str

    def action_for(self, subject: str) -> str:
        """What to do about this subject."""
        return self.action.replace("{subject}", subject)


def _error(code: str, meaning: str, action: str) -> FaultKind:
    return FaultKind(code, "error", meaning, action)


def _warning(code: str, meaning: str, action: str) -> FaultKind:
    return FaultKind(code, "warning", meaning, action)


# What a camera's tracker finds; the subject is the camera, of a colour's faults the colour.
_CAMERA = (
    _error(
        "camera_dark",
        "the camera's picture is black",
        "take off the lens cap, switch on the light, or `rhot calibrate camera {subject}`",
    ),
    _error(
        "camera_frozen",
        "the camera delivers the same picture again and again",
        "restart its tracker; if it comes back, reseat the camera's cable",
    ),
    _warning(
        "camera_saturated",
        "much of the picture is white: colours there are lost",
        "less light, or `rhot calibrate camera {subject}`",
    ),
    _warning(
        "camera_slow",
        "the camera delivers fewer pictures than rig.toml says",
        "lower fps or size_px in rig.toml, or stop what else runs on that computer",
    ),
    _warning(
        "camera_automatic",
        "exposure or white balance are left to the camera's automatics, so that colours drift",
        "run `rhot calibrate camera {subject}`",
    ),
    _warning(
        "camera_processing",
        "the camera sharpens or denoises its pictures, or delivers another size than asked for",
        "update picamera2 with `sudo apt full-upgrade`; markers are placed less well until then",
    ),
    _warning(
        "camera_setting",
        "the camera's driver refuses a setting",
        "see `v4l2-ctl --list-ctrls` for what it takes; choose other fps or size_px in rig.toml",
    ),
    _warning(
        "camera_readout_unknown",
        "the sensor is not known: its rows count as exposed at once, which places fast markers less"
        " well",
        "use a camera v1 or v2, or one with a global shutter",
    ),
    _warning(
        "camera_unsynced",
        "the camera is to expose together with others, and finds no partner",
        "give one camera the other role of `sync` in rig.toml, at the same fps",
    ),
    _error(
        "colors_missing",
        "colours that rig.toml's hands use have no range",
        "run `rhot calibrate colors {subject}`",
    ),
    _warning(
        "color_drifted",
        "the light has changed: a colour's range no longer fits its paint",
        "run `rhot calibrate colors` for that camera",
    ),
    _warning(
        "request_refused",
        "somebody asked this service for something that it cannot do",
        "ask with a query to hear the reason, see docs/guide/operations.md",
    ),
    _error(
        "clock_unknown",
        "the camera's clock could not be compared with the master's",
        "see whether fusion runs: it answers for the master's clock",
    ),
    _warning(
        "session_stopped",
        "the session is stopped: no markers are sent",
        "run `rhot session start`",
    ),
)

# What fusion finds; the subject is a camera, a pair of cameras or a marker's colour.
_FUSION = (
    _warning(
        "marker_not_seen",
        "a marker is not seen by one camera or by all",
        "is it in view and lit? If so, its range no longer fits: `rhot calibrate colors`",
    ),
    _error(
        "camera_silent",
        "no markers arrive from a camera",
        "look at its tracker: `systemctl status rhot-pi-tracker@{subject}` on its computer",
    ),
    _error(
        "camera_moved",
        "two cameras' views no longer fit together: one has moved since the calibration",
        "fasten it and run `rhot calibrate stereo`",
    ),
    _error(
        "cameras_mirrored",
        "two cameras' views are mirror images of each other",
        "set hflip and vflip of both as they were at the calibration",
    ),
    _error(
        "camera_wrong_size",
        "a camera's pictures have another size than its calibration",
        "calibrate {subject} at the size it runs at: `rhot calibrate lens {subject}`",
    ),
    _error(
        "camera_clock_off",
        "a camera's stamps are far off the others'",
        "see `clock_offset_ms` in that tracker's health; restart its tracker",
    ),
    _warning(
        "camera_unknown",
        "markers arrive of a camera that rig.toml does not name",
        "add a [[camera]] table, or stop that tracker",
    ),
    _error(
        "second_service",
        "two services of the same name run for this rig, and publish each other's results",
        "stop one of them, or give one rig another name in rig.toml",
    ),
    _error(
        "second_clock",
        "more than one service answers for the master's clock",
        "stop the second fusion; `rhot doctor` names where they run",
    ),
    _error(
        "not_calibrated",
        "a calibration that this service needs is missing or broken",
        "run `rhot check` on the rig.toml: it names the command",
    ),
)

# What all services find of themselves and their computer.
_SERVICE = (
    _warning(
        "stream_slow",
        "a stream is below its expected rate",
        "`rhot doctor` finds the first link that is broken",
    ),
    _warning(
        "event",
        "something went wrong once",
        "read the text; `journalctl -u 'rhot-*'` has what came before",
    ),
    _error(
        "disk_full",
        "a file could not be written: the disk is full",
        "free some space; `df -h` shows where",
    ),
    _warning("disk_low", "the disk is nearly full", "free some space; `df -h` shows where"),
    _warning(
        "computer_hot",
        "the computer is hot, and will soon slow down",
        "give it a fan or a heat sink",
    ),
    _warning(
        "computer_throttled",
        "the computer has slowed down, for heat or for a weak power supply",
        "give it a fan, and the power supply made for it",
    ),
    _warning(
        "certificate_expiring",
        "this host's certificate ends soon",
        "run `rhot pki renew` and bring the files to the host",
    ),
    _error(
        "recorder_behind",
        "the recorder cannot write as fast as messages come: some are lost",
        "record to a faster disk",
    ),
    _warning(
        "names_flooded",
        "messages come under more names than a rig has: those of strangers are left out",
        "see with `rhot top` who publishes; a secured bus refuses strangers",
    ),
    _warning(
        "object_unregistered",
        "an object's tracker is not registered to the rig: its poses are in the lighthouse's frame",
        "register it: `rhot calibrate objects`",
    ),
    _warning(
        "device_unknown",
        "a tracked device is none of rig.toml's [[object]] tables",
        "add an [[object]] table with its serial",
    ),
    _error(
        "source_lost",
        "a source of poses or pictures has ended, and is tried again",
        "see its text; `rhot doctor` finds the first link that is broken",
    ),
)

# What somebody who looks at the whole rig finds: `rhot top`, `rhot doctor`, the page.
_RIG = (
    _error(
        "router_unreachable",
        "the router does not answer",
        "start it: `systemctl start rhot-router` on the master, or `rhot up rig.toml`",
    ),
    _error(
        "certificate_refused",
        "the router refuses this host's certificate, or this host the router's",
        "`rhot pki list` shows who has which; issue a new one",
    ),
    _error("service_absent", "a service that rig.toml calls for has never been heard", "start it"),
    _error("service_gone", "a service has ended", "see its journal for the reason"),
    _error(
        "service_silent",
        "a service has stopped telling its health",
        "its computer is overloaded or unreachable",
    ),
    _error(
        "config_broken",
        "rig.toml is missing, or says something that cannot be",
        "run `rhot check` on it: it lists every problem",
    ),
    _error(
        "no_points",
        "fusion gives no points of a hand, although cameras see markers",
        "hold the hand into view of two cameras; see fusion's journal",
    ),
    _error(
        "no_pose",
        "the solver gives no pose of a hand, although fusion gives points",
        "are the wrist and three fingers seen? If so, see the solver's journal",
    ),
    _error(
        "pose_implausible",
        "poses are nowhere near the cameras",
        "calibrate the rig anew: `rhot calibrate stereo`",
    ),
)

FAULTS: dict[str, FaultKind] = {kind.code: kind for kind in (*_CAMERA, *_FUSION, *_SERVICE, *_RIG)}


def fault_kind(code: str) -> FaultKind:
    """The kind of that code; raises RhotError on one that is not in the list."""
    try:
        return FAULTS[code]
    except KeyError:
        raise RhotError(f"{code!r} is no fault code; valid: {', '.join(FAULTS)}") from None
