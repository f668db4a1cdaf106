"""The way from router to pose, as codes: what breaks first breaks what comes after it. Pure data.

`rhot doctor` judges its links in this order, and the page shows what only follows under its cause.
"""

from __future__ import annotations

from rhot.messages.health import Fault

ROUTER = ("config_broken", "certificate_refused", "router_unreachable")
# Of a service that is not there, as an onlooker finds it.
MISSING = ("service_absent", "service_gone", "service_silent")
ONE_OF_EACH = ("second_service", "second_clock")
SESSION = ("session_stopped",)
PICTURE = (
    "camera_dark",
    "camera_frozen",
    "camera_saturated",
    "camera_slow",
    "camera_silent",
    "camera_automatic",
    "camera_processing",
    "camera_setting",
    "camera_readout_unknown",
    "camera_unsynced",
    "source_lost",
)
CLOCK = ("clock_unknown", "camera_clock_off", "camera_clock_aligned")
COLORS = ("colors_missing", "color_drifted")
MARKERS = ("marker_not_seen", "marker_at_edge")
# Codes of fusion's of the cameras together.
VIEWS = (
    "camera_wrong_size",
    "camera_moved",
    "cameras_mirrored",
    "camera_unknown",
    "not_calibrated",
)
# Seen from outside, of what other links are the reason for.
RESULTS = ("no_points", "no_pose", "pose_implausible")
# A slow camera makes poses late and few; it hides nothing that keeps them away.
SLOW = ("camera_slow", "stream_slow")
WAY = (ROUTER, MISSING, ONE_OF_EACH, SESSION, PICTURE, CLOCK, COLORS, MARKERS, VIEWS, RESULTS)
# Faults that stand while something before them on the way is broken, whether or not they would
# without: a tracker without a master knows no clock, a dark camera sees no marker.
FOLLOWING = {
    *SESSION,
    *MARKERS,
    *RESULTS,
    "camera_silent",
    "camera_unsynced",
    "clock_unknown",
    "stream_slow",
}
# Warnings that explain why there is no pose, or not the pose one wants: they break their link.
_EXPLAINS = {
    "camera_saturated",
    "camera_slow",
    "color_drifted",
    "marker_not_seen",
    "session_stopped",
    "camera_unknown",
}


def breaks(fault: Fault) -> bool:
    """Whether a fault breaks its link of the way, rather than making it worse."""
    return fault.severity == "error" or fault.code in _EXPLAINS


def place_on_way(code: str) -> int:
    """How far along the way a code's link is; after all of it for codes that have no link there."""
    return next((place for place, codes in enumerate(WAY) if code in codes), len(WAY))
