"""A computer's temperature, throttling and free space, from the files in which Linux tells them.

Nothing is run: `vcgencmd` needs a device that a sandboxed service does not have. What a machine
does not tell is None. root stands for /, so that tests can show other machines.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

# A Raspberry Pi's firmware slows it down from 80 C on (a 3B+ from 60, which it tells by itself
# below); two degrees before that somebody should know.
_PI_HOT_C = 78.0
# A PC's processor slows down by itself at 95 to 105 C.
_PC_HOT_C = 92.0
_PI_ZONES = {"cpu-thermal", "cpu_thermal"}
_PC_ZONES = {"x86_pkg_temp", "acpitz", "cpu"}
# Of a sensor that tells nonsense.
_POSSIBLE_C = (-30.0, 150.0)
# Over once it is clearly cooler, or it would come and go with each picture.
_COOLER_C = 4.0
# A recording grows by 2 MB a minute: four hours. Over once some more is free.
_LOW_MB, _ENOUGH_MB = 500.0, 600.0
# Bits of the Pi firmware's get_throttled that tell of now; those from 16 on tell of the past.
_THROTTLED = (
    (0, "its power supply is too weak"),
    (1, "its clock is capped"),
    (2, "it is throttled"),
    (3, "it is at its soft limit of temperature"),
)


@dataclass(frozen=True)
class Computer:
    """What a computer tells of itself now.

    throttled is why it has slowed down, "" if it has not; free_mb is by folder.
    """

    temperature_c: float | None = None
    hot_c: float = _PC_HOT_C
    throttled: str | None = None
    free_mb: dict[str, float] | None = None


def read_computer(folders: Iterable[Path] = (), root: Path = Path("/")) -> Computer:
    """Read what this computer tells; folders are those whose free space matters."""
    temperature_c, hot_c = _temperature(root)
    return Computer(temperature_c, hot_c, _throttled(root), _free_mb(folders))


def _temperature(root: Path) -> tuple[float | None, float]:
    """The hottest processor's temperature, and the one from which on it is hot."""
    found: list[tuple[float, float]] = []
    for zone in sorted((root / "sys/class/thermal").glob("thermal_zone*")):
        kind, milli_c = _text(zone / "type"), _number(zone / "temp")
        hot_c = _PI_HOT_C if kind in _PI_ZONES else _PC_HOT_C if kind in _PC_ZONES else None
        if hot_c is None or milli_c is None:
            continue
        if _POSSIBLE_C[0] < milli_c * 1e-3 < _POSSIBLE_C[1]:
            found.append((milli_c * 1e-3, hot_c))
    return max(found, default=(None, _PC_HOT_C))


def _throttled(root: Path) -> str | None:
    """Why a Pi has slowed down, "" if it has not; None of another computer."""
    reasons: list[str] | None = None
    bits = _number(root / "sys/devices/platform/soc/soc:firmware/get_throttled", 16)
    if bits is not None:
        reasons = [why for bit, why in _THROTTLED if bits >> bit & 1]
    # Some kernels' get_throttled is always 0 (raspberrypi/linux #2367); the voltage's alarm is not.
    for monitor in sorted((root / "sys/class/hwmon").glob("hwmon*")):
        if _text(monitor / "name") == "rpi_volt":
            reasons = reasons or []
            if _number(monitor / "in0_lcrit_alarm") and _THROTTLED[0][1] not in reasons:
                reasons.append(_THROTTLED[0][1])
    return None if reasons is None else ", ".join(reasons)


def _free_mb(folders: Iterable[Path]) -> dict[str, float]:
    """Free space of each folder, one of each file system; a folder to come counts as its parent."""
    found: dict[int, tuple[str, float]] = {}
    for folder in folders:
        there = next((one for one in (folder, *folder.parents) if one.exists()), None)
        if there is None:
            continue
        try:
            space, device = os.statvfs(there), there.stat().st_dev
        except OSError:
            continue
        found.setdefault(device, (str(there), space.f_bavail * space.f_frsize * 1e-6))
    return dict(found.values())


def faults_of(computer: Computer, host: str, standing: Iterable[str]) -> dict[str, dict[str, str]]:
    """What is wrong with a computer: the texts by subject, for each code.

    standing are the codes that are told now: a fault ends a little later than it begins.
    """
    now = set(standing)
    hot: dict[str, str] = {}
    limit_c = computer.hot_c - (_COOLER_C if "computer_hot" in now else 0.0)
    if computer.temperature_c is not None and computer.temperature_c >= limit_c:
        hot[host] = f"{host} is at {computer.temperature_c:.0f} C"
    slow = {host: f"{host} has slowed down: {computer.throttled}"} if computer.throttled else {}
    limit_mb = _ENOUGH_MB if "disk_low" in now else _LOW_MB
    low = {
        f"{host}:{folder}": f"{free_mb:.0f} MB are left in {folder} of {host}"
        for folder, free_mb in (computer.free_mb or {}).items()
        if free_mb < limit_mb
    }
    return {"computer_hot": hot, "computer_throttled": slow, "disk_low": low}


def values_of(computer: Computer) -> dict[str, float]:
    """Figures for health: `temperature_c` and `disk_free_mb`, of those that are known."""
    values: dict[str, float] = {}
    if computer.temperature_c is not None:
        values["temperature_c"] = round(computer.temperature_c, 1)
    if computer.free_mb:
        values["disk_free_mb"] = round(min(computer.free_mb.values()), 0)
    return values


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace").strip()
    except OSError:
        return ""


def _number(path: Path, base: int = 10) -> int | None:
    try:
        return int(_text(path), base)
    except ValueError:
        return None
