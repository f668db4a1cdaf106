"""A capture without pictures: markers.jsonl instead, and truth_points.jsonl.

What is written of a motion that has no bones to render. `rhot track` takes the markers as they are.
The hand that is saved with it has paint without extent: its landmarks are the markers themselves.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot.errors import CaptureError
from rhot.files.calibration import save
from rhot.files.capture import write_lines
from rhot.hand import default_hand
from services.simulator.camera.marker_source import marker_frames, point_truth
from services.simulator.files.capture_writer import START_NS, copy_rig, make_folder
from services.simulator.recorded_motion.bones import RECORDED
from services.simulator.recorded_motion.scenes import PointScene


def write_marker_capture(scene: PointScene, seconds: float, folder: Path) -> int:
    """Write `seconds` into a new or empty folder; returns the number of marker frames.

    Raises CaptureError if the folder is in use or cannot be written.
    """
    capture = make_folder(folder)
    try:
        copy_rig(scene.config, capture)
        model = default_hand(scene.hand)
        paint = {
            name: msgspec.structs.replace(dab, offset_m=(0.0, 0.0, 0.0), radius_m=0.0, extent_m=0.0)
            for name, dab in model.paint.items()
        }
        model = msgspec.structs.replace(model, paint=paint, origin=RECORDED)
        save(folder / "calibration" / f"hand.{scene.hand}.json", model)
        write_lines(folder / "truth_points.jsonl", point_truth(scene, seconds, START_NS))
        return write_lines(capture.markers, marker_frames(scene, seconds, START_NS))
    except OSError as error:
        raise CaptureError(f"{folder}: cannot be written: {error}") from None
