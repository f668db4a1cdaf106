"""A simulated capture as two phones would have filmed it: two videos that share no clock."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np

from rhot.files.capture import Capture, read_stamps
from services.pi_tracker.image.yuv_planes import bgr_image
from services.pi_tracker.sources.capture import CaptureReader
from testing.phone_videos import write_phone_video

# Sizes of the phones' pictures as shares of the capture's, and how late the right one begins.
SCALES, LATE_S = {"left": 0.75, "right": 0.875}, 0.2
# Share of frames that a phone leaves out, which makes its rate variable.
_LEFT_OUT = 0.08


def write_phone_pair(capture: Path, folder: Path, seed: int = 1) -> float:
    """left.mp4 and right.mp4 of a capture of these two cameras, and a calibration that fits.

    By how many seconds the right video begins later: its times are as much earlier.
    """
    begins_ns = {}
    shutil.copytree(capture / "calibration", folder / "calibration")
    generator = np.random.default_rng(seed)
    for camera, late_s in (("left", 0.0), ("right", LATE_S)):
        scale = SCALES[camera]
        reader, pictures, stamps_ns = CaptureReader(camera, capture), [], []
        reader.open()
        first_ns = read_stamps(Capture(capture).stamps("left"))[0].stamp_ns
        while (frame := reader.read()) is not None:
            if frame.stamp_ns < first_ns + 1e9 * late_s or generator.random() < _LEFT_OUT:
                continue
            size_px = (round(scale * frame.size_px[0]), round(scale * frame.size_px[1]))
            resized = cv2.resize(bgr_image(frame), size_px, interpolation=cv2.INTER_AREA)
            pictures.append(np.ascontiguousarray(resized[:, :, ::-1]))
            # A phone stamps the middle of its exposure; the simulator the first row's.
            middle_ns = 0.5 * frame.size_px[1] * frame.row_time_ns
            stamps_ns.append(frame.stamp_ns + middle_ns)
        reader.close()
        begins_ns[camera] = stamps_ns[0]
        times_s = [1e-9 * (stamp_ns - stamps_ns[0]) for stamp_ns in stamps_ns]
        write_phone_video(folder / f"{camera}.mp4", pictures, times_s)
        _scale_lens(folder / "calibration" / f"{camera}.lens.json", scale)
    return float(1e-9 * (begins_ns["right"] - begins_ns["left"]))


def _scale_lens(path: Path, scale: float) -> None:
    """The lens of pictures that were resized."""
    lens = json.loads(path.read_text())
    lens["size_px"] = [round(scale * side) for side in lens["size_px"]]
    matrix = np.array(lens["matrix"])
    matrix[:2] *= scale
    # Pixel (0, 0) is the middle of the first pixel.
    matrix[:2, 2] += 0.5 * (scale - 1.0)
    lens["matrix"] = matrix.tolist()
    path.write_text(json.dumps(lens))
