"""The angles that triad_openvr prints, back to a rotation. Pure.

Its convert_to_euler has yaw = atan2(m10, m00) and roll = atan2(m21, m22), as usual for R = Rz Ry
Rx, but pitch = atan2(m20, m00): not an angle of that product, though yaw and it together still tell
the rotation (m00 = cos(yaw) cos(theta), m20 = -sin(theta)).
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array, rotation_x, rotation_y, rotation_z

# Both angles are printed with four decimals of a degree (2e-6 rad). Where cos(pitch) is below this,
# they no longer tell theta to a degree.
_LEAST_COSINE = 1e-4
# What that rounding makes of two cosines near 0.
_ROUNDING = 1e-5


def rotation_from_triad_angles(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Array | None:
    """The rotation (3, 3) whose triad_openvr angles these are.

    None if there is none (yaw and pitch are both atan2 over m00: their cosines have one sign), or
    where it cannot be told (a pitch near 90 deg).
    """
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    cos_yaw, cos_pitch = float(np.cos(yaw)), float(np.cos(pitch))
    # Written so that NaN fails it.
    if not abs(cos_pitch) >= _LEAST_COSINE or not np.isfinite([cos_yaw, roll]).all():
        return None
    if cos_yaw * np.sign(cos_pitch) < -_ROUNDING:
        return None
    theta = -float(np.arctan(cos_yaw * np.sin(pitch) / cos_pitch))
    rotation: Array = rotation_z(yaw) @ rotation_y(theta) @ rotation_x(roll)
    return rotation
