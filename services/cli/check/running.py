"""What lives on other machines, as far as the rig runs and can be asked: colours and exposures."""

from __future__ import annotations

from pathlib import Path

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from rhot.messages.camera import ExposureControl
from services.cli.check.colors import color_problems
from services.cli.check.problems import Problem, note, warning
from services.cli.rig.answers import Answers
from services.cli.rig.place import Place


def questions_to(config: RigConfig, place: Place) -> list[str]:
    """Cameras whose trackers must be asked: those that run on other machines."""
    if not place.master:
        return []
    return [camera.name for camera in config.camera if camera.name not in place.cameras]


def check_remote_cameras(
    config: RigConfig, path: Path, place: Place, answers: Answers
) -> list[Problem]:
    """Colours and exposures that trackers of other machines told, or that nobody could ask."""
    names = questions_to(config, place)
    if not names:
        return []
    if not answers.router:
        text = (
            f"no router answers ({answers.why_not}): colours and exposure of "
            f"{' and '.join(names)} live beside the cameras, and are checked once the rig runs"
        )
        return [note(path, text)]
    problems = []
    for name in names:
        problems += _of_camera(config, config.camera_named(name), answers)
    return problems


def _of_camera(config: RigConfig, camera: CameraTable, answers: Answers) -> list[Problem]:
    where = f"tracker of {camera.name} on {camera.host}"
    colors, exposure = answers.colors.get(camera.name), answers.exposures.get(camera.name)
    if colors is None:
        text = (
            "is not running: its colours and exposure cannot be checked from here; start it with "
            f"`systemctl start rhot-pi-tracker@{camera.name}` there"
        )
        return [note(where, text)]
    problems = color_problems(config, camera, colors, where)
    if exposure is not None and _is_automatic(exposure):
        text = (
            "has no fixed exposure: colours drift while it is automatic. Fix it with "
            f"`rhot calibrate camera {camera.name} --auto`"
        )
        problems.append(warning(where, text))
    return problems


def _is_automatic(exposure: ExposureControl) -> bool:
    fixed = exposure.mode == "fixed" and exposure.exposure_us > 0.0
    return exposure.adjustable and not fixed
