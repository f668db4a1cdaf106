"""TRC and MOT, the files of OpenSim: where all joints are, and the joint angles. Pure.

TRC holds positions in mm as if each joint were a marker; MOT the angles in degrees and the wrist's
position in m. Both have y up, as OpenSim's ground has. After OpenSim's documentation of its formats
("Marker (.trc) Files", "Motion (.mot) Files").
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rhot.hand import DIGIT_ANGLES, DIGITS
from rhot.hand_mesh.skinned_hand import SKIN_JOINTS
from services.cli.export.motion.clip import Clip

_TRC_HEAD = (
    "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
)


def trc_lines(clip: Clip) -> Iterator[str]:
    """Positions of all joints but the palm, in mm."""
    n, rate = len(clip.wrist_m), f"{clip.rate_hz:.3f}"
    yield f"PathFileType\t4\t(X/Y/Z)\t{clip.hand}_hand.trc"
    yield _TRC_HEAD.replace(" ", "\t")
    yield f"{rate}\t{rate}\t{n}\t{len(SKIN_JOINTS)}\tmm\t{rate}\t1\t{n}"
    yield "Frame#\tTime\t" + "\t\t\t".join(SKIN_JOINTS) + "\t\t"
    numbers = range(1, len(SKIN_JOINTS) + 1)
    yield "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in numbers)
    yield ""
    rows = 1e3 * clip.positions_m().reshape(n, -1)
    for frame, (seconds, row) in enumerate(zip(clip.times_s, rows, strict=True), start=1):
        yield f"{frame}\t{seconds:.6f}\t" + "\t".join(f"{value:.4f}" for value in row)


def mot_lines(clip: Clip) -> Iterator[str]:
    """Angles in degrees, and the wrist's position in m."""
    names = ["wrist_tx", "wrist_ty", "wrist_tz"]
    for digit, angles in zip(DIGITS, DIGIT_ANGLES, strict=True):
        names += [f"{digit}_{angle}" for angle in angles]
    n = len(clip.wrist_m)
    rows = np.concatenate([clip.wrist_m, np.degrees(clip.angles_rad).reshape(n, -1)], axis=1)
    yield f"{clip.hand} hand"
    yield "version=1"
    yield f"nRows={n}"
    yield f"nColumns={len(names) + 1}"
    yield "inDegrees=yes"
    yield "endheader"
    yield "\t".join(["time", *names])
    for seconds, row in zip(clip.times_s, rows, strict=True):
        yield f"{seconds:.6f}\t" + "\t".join(f"{value:.6f}" for value in row)
