"""The table for rig.toml that `rhot calibrate world` prints. Pure text."""

from __future__ import annotations

from rhot.geometry.camera import Camera
from services.calibrator.output.calibration_files import rows
from services.calibrator.rig.world_frame import WorldFrame


def world_table(world: WorldFrame, first: Camera) -> str:
    """[rig.world] with T_rig_from_camera of the first camera, the world as the new rig frame."""
    T_world_from_camera = world.T_world_from_rig @ first.T_rig_from_camera
    x, y, z = T_world_from_camera[:3, 3]
    lines = ",\n".join(
        "  [" + ", ".join(f"{value:.9g}" for value in row) + "]"
        for row in rows(T_world_from_camera)
    )
    return (
        f"# board seen by {', '.join(world.cameras)}, {world.rms_px:.2f} px; camera {first.name} "
        f"at {x:.3f}, {y:.3f}, {z:.3f} m above the desk\n"
        f"# Paste into rig.toml:\n[rig.world]\nT_rig_from_camera = [\n{lines},\n]"
    )
