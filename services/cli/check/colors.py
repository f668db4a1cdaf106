"""Problems of a camera's colour ranges and exposure in calibration/."""

from __future__ import annotations

from functools import partial
from itertools import combinations

from rhot.files.calibration import ColorRange, Colors, load_colors, load_exposure
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from services.cli.check.problems import Problem, error, load_or_report, warning

# Sources that are cameras with controls, which want a fixed exposure.
_WITH_CONTROLS = ("picamera2", "v4l2")


def check_colors(config: RigConfig, camera: CameraTable) -> list[Problem]:
    """Colours that are missing, and pairs whose ranges overlap."""
    path = config.calibration_dir / f"{camera.name}.colors.json"
    problems: list[Problem] = []
    colors = load_or_report(
        partial(load_colors, config.calibration_dir, camera.name), problems, path
    )
    return problems if colors is None else color_problems(config, camera, colors, str(path))


def color_problems(
    config: RigConfig, camera: CameraTable, colors: Colors, where: str
) -> list[Problem]:
    """What is wrong with the colours of a file, or of a tracker; where names it."""
    problems: list[Problem] = []
    wanted = config.tracked_colors(colors.colors)
    for name in wanted:
        if name not in colors.colors:
            has = ", ".join(sorted(colors.colors)) or "none"
            text = (
                f"colour {name!r}{_wearer(config, name)} is missing; it has {has}. "
                f"Add it with `rhot calibrate colors {camera.name}`"
            )
            problems.append(error(where, text))
    for a, b in combinations([name for name in wanted if name in colors.colors], 2):
        if overlap(colors.colors[a], colors.colors[b]):
            text = (
                f"the ranges of {a!r} and {b!r} overlap: a blob of one may be taken for the other; "
                "narrow them with `rhot calibrate colors`"
            )
            problems.append(warning(where, text))
    return problems


def _wearer(config: RigConfig, color: str) -> str:
    wearer = config.wearer(color)
    return f" of {wearer}" if wearer else ""


def overlap(a: ColorRange, b: ColorRange) -> bool:
    """Whether some HSV value lies in both ranges; hue wraps where low > high."""
    share_saturation_and_value = all(
        max(a.hsv_low[i], b.hsv_low[i]) <= min(a.hsv_high[i], b.hsv_high[i]) for i in (1, 2)
    )
    share_hue = any(max(x[0], y[0]) <= min(x[1], y[1]) for x in _hues(a) for y in _hues(b))
    return share_saturation_and_value and share_hue


def _hues(color: ColorRange) -> list[tuple[int, int]]:
    low, high = color.hsv_low[0], color.hsv_high[0]
    return [(low, high)] if low <= high else [(low, 179), (0, high)]


def check_exposure(config: RigConfig, camera: CameraTable) -> list[Problem]:
    """A broken file, or none for a camera whose exposure can be fixed."""
    path = config.calibration_dir / f"{camera.name}.exposure.json"
    problems: list[Problem] = []
    if path.exists():
        load_or_report(partial(load_exposure, config.calibration_dir, camera.name), problems, path)
    elif camera.source.split(":")[0] in _WITH_CONTROLS:
        text = (
            "no such file; colours drift while exposure is automatic. "
            f"Make it with `rhot calibrate camera {camera.name}`"
        )
        problems.append(warning(path, text))
    return problems
