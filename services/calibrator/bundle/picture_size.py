"""A lens's calibration holds for the size of pictures that it was made at. Pure."""

from __future__ import annotations

from rhot.errors import CalibrationError
from rhot.geometry.camera import Camera
from rhot.messages import MarkerFrame


def check_size(frame: MarkerFrame, camera: Camera) -> None:
    """Raises CalibrationError where the markers are of pictures of another size."""
    if tuple(frame.size_px) == tuple(camera.size_px):
        return
    seen, calibrated = ("{}x{}".format(*size) for size in (frame.size_px, camera.size_px))
    raise CalibrationError(
        f"camera {frame.camera!r}: its pictures are {seen}, its lens was calibrated at "
        f"{calibrated}; set that size, or run `rhot calibrate stereo` at this one"
    )
