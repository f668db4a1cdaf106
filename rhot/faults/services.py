"""Faults of services, their computers, and of a rig as an onlooker sees it. Pure data."""

from __future__ import annotations

from rhot.faults.kind import error, warning

# What all services find of themselves and their computer.
SERVICE = (
    warning(
        "stream_slow",
        "a stream is below its expected rate",
        "`rhot doctor` finds the first link that is broken",
    ),
    warning(
        "event",
        "something went wrong once",
        "read the text; `journalctl -u 'rhot-*'` has what came before",
    ),
    error(
        "disk_full",
        "a file could not be written: the disk is full",
        "free some space (`df -h` shows where), or write to another disk",
    ),
    warning("disk_low", "the disk is nearly full", "free some space; `df -h` shows where"),
    warning(
        "computer_hot",
        "the computer is hot, and will soon slow down",
        "give it a fan or a heat sink",
    ),
    warning(
        "computer_throttled",
        "the computer has slowed down, for heat or for a weak power supply",
        "give it a fan, and the power supply made for it",
    ),
    warning(
        "certificate_expiring",
        "this host's certificate ends soon",
        "run `rhot pki renew` and bring the files to the host",
    ),
    error(
        "recorder_behind",
        "the recorder cannot write as fast as messages come: some are lost",
        "record to a faster disk",
    ),
    warning(
        "names_flooded",
        "messages come under more names than a rig has: those of strangers are left out",
        "see with `rhot top` who publishes; a secured bus refuses strangers",
    ),
    error(
        "source_lost",
        "a source of poses or pictures has ended, and is tried again",
        "see its text; `rhot doctor` finds the first link that is broken",
    ),
)

# What somebody who looks at the whole rig finds: `rhot top`, `rhot doctor`, the page.
RIG = (
    error(
        "router_unreachable",
        "the router does not answer",
        "start it: `systemctl start rhot-router` on the master, or `rhot up rig.toml`",
    ),
    error(
        "certificate_refused",
        "the router refuses this host's certificate, or this host the router's",
        "`rhot pki list` shows who has which; issue a new one",
    ),
    error("service_absent", "a service that rig.toml calls for has never been heard", "start it"),
    error("service_gone", "a service has ended", "see its journal for the reason"),
    error(
        "service_silent",
        "a service has stopped telling its health",
        "its computer is overloaded or unreachable",
    ),
    error(
        "config_broken",
        "rig.toml is missing, or says something that cannot be",
        "run `rhot check` on it: it lists every problem",
    ),
    error(
        "no_points",
        "fusion gives no points of a hand, although cameras see markers",
        "hold the hand into view of two cameras; see fusion's journal",
    ),
    error(
        "no_pose",
        "the solver gives no pose of a hand, although fusion gives points",
        "are the wrist and three fingers seen? If so, see the solver's journal",
    ),
    error(
        "pose_implausible",
        "poses are nowhere near the cameras",
        "calibrate the rig anew: `rhot calibrate stereo`",
    ),
)
