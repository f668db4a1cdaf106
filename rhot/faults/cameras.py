"""Faults of cameras and of what they see together. Pure data."""

from __future__ import annotations

from rhot.faults.kind import error, warning

# What a camera's tracker finds; the subject is the camera, of a colour's faults the colour.
CAMERA = (
    error(
        "camera_dark",
        "the camera's picture is black",
        "take off the lens cap, switch on the light, or `rhot calibrate camera {subject}`",
    ),
    error(
        "camera_frozen",
        "the camera delivers the same picture again and again",
        "restart its tracker; if it comes back, reseat the camera's cable",
    ),
    warning(
        "camera_saturated",
        "much of the picture is white: colours there are lost",
        "less light, or `rhot calibrate camera {subject}`",
    ),
    warning(
        "camera_slow",
        "the camera delivers fewer pictures than rig.toml says",
        "lower fps or size_px in rig.toml, or stop what else runs on that computer",
    ),
    warning(
        "camera_automatic",
        "exposure or white balance are left to the camera's automatics, so that colours drift",
        "run `rhot calibrate camera {subject}`",
    ),
    warning(
        "camera_processing",
        "the camera sharpens or denoises its pictures, or delivers another size than asked for",
        "update picamera2 with `sudo apt full-upgrade`; markers are placed less well until then",
    ),
    warning(
        "camera_setting",
        "the camera's driver refuses a setting",
        "see `v4l2-ctl --list-ctrls` for what it takes; choose other fps or size_px in rig.toml",
    ),
    warning(
        "camera_readout_unknown",
        "the sensor is not known: its rows count as exposed at once, which places fast markers less"
        " well",
        "use a camera v1 or v2, or one with a global shutter",
    ),
    warning(
        "camera_unsynced",
        "the camera is to expose together with others, and finds no partner",
        "give one camera the other role of `sync` in rig.toml, at the same fps",
    ),
    error(
        "colors_missing",
        "colours that rig.toml's hands use have no range",
        "run `rhot calibrate colors {subject}`",
    ),
    warning(
        "color_drifted",
        "the light has changed: a colour's range no longer fits its paint",
        "run `rhot calibrate colors` for that camera",
    ),
    warning(
        "request_refused",
        "somebody asked this service for something that it cannot do",
        "ask with a query to hear the reason, see docs/guide/operations.md",
    ),
    error(
        "clock_unknown",
        "the camera's clock could not be compared with the master's",
        "see whether fusion runs: it answers for the master's clock",
    ),
    warning(
        "session_stopped",
        "the session is stopped: no markers are sent",
        "run `rhot session start`",
    ),
)

# What fusion finds; the subject is a camera, a pair of cameras or a marker's colour.
FUSION = (
    warning(
        "marker_not_seen",
        "a marker is not seen by one camera or by all",
        "is it in view and lit? If so, its range no longer fits: `rhot calibrate colors`",
    ),
    warning(
        "marker_at_edge",
        "the edge of a camera's picture cuts markers: they are placed less well, and may leave it",
        "move the hand towards the middle of what both cameras see, or the cameras back",
    ),
    error(
        "camera_silent",
        "no markers arrive from a camera",
        "look at its tracker: `systemctl status rhot-pi-tracker@{subject}` on its computer",
    ),
    error(
        "camera_moved",
        "two cameras' views no longer fit together: one has moved since the calibration",
        "fasten it and run `rhot calibrate stereo`",
    ),
    error(
        "cameras_mirrored",
        "two cameras' views are mirror images of each other",
        "set hflip and vflip of both as they were at the calibration",
    ),
    error(
        "camera_wrong_size",
        "a camera's pictures have another size than its calibration",
        "calibrate {subject} at the size it runs at: `rhot calibrate lens {subject}`",
    ),
    error(
        "camera_clock_off",
        "a camera's stamps are far off the others'",
        "see `clock_offset_ms` in that tracker's health; restart its tracker",
    ),
    warning(
        "camera_clock_aligned",
        "a camera's stamps are off the others'; its markers are shifted to where their motion fits",
        "see `clock_offset_ms` in that tracker's health; restart its tracker",
    ),
    warning(
        "camera_unknown",
        "markers arrive of a camera that rig.toml does not name",
        "add a [[camera]] table, or stop that tracker",
    ),
    error(
        "second_service",
        "two services of the same name run for this rig, and publish each other's results",
        "stop one of them, or give one rig another name in rig.toml",
    ),
    error(
        "second_clock",
        "more than one service answers for the master's clock",
        "stop the second fusion; `rhot doctor` names where they run",
    ),
    error(
        "not_calibrated",
        "a calibration that this service needs is missing or broken",
        "run `rhot check` on the rig.toml: it names the command",
    ),
)
