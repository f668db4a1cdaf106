"""rig.toml, the one file people write: strict, frozen, with errors that name file, field and
allowed values.

Calibration results live in other files (rhot/files/calibration.py) and are never touched from here.
A missing table means its defaults; an unknown table or key is an error, with the nearest valid
name.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import msgspec

from rhot.errors import ConfigError
from rhot.files.bridge_tables import Bridges
from rhot.files.config_errors import explain
from rhot.files.rig_tables import (
    Bus,
    CameraTable,
    Fusion,
    HandTable,
    Metrics,
    Objects,
    ObjectTable,
    Recorder,
    RigTable,
    Solver,
    Table,
    Tracker,
    Viewer,
)
from rhot.files.simulator_table import Simulator
from rhot.files.table_rules import joints_problem, markers_problem, shape_problem
from rhot.files.viewer_access import access_problem
from rhot.hand import CHAIN_JOINTS, DIGITS, HANDS, JOINTS
from rhot.topics import Rate


class RigConfig(Table, frozen=True, kw_only=True):
    """All of rig.toml. `folder` is where it was read from; relative paths start there."""

    rig: RigTable = RigTable()
    bus: Bus = Bus()
    camera: list[CameraTable] = msgspec.field(default_factory=list)
    tracker: Tracker = Tracker()
    hand: dict[Literal["left", "right"], HandTable] = msgspec.field(default_factory=dict)
    fusion: Fusion = Fusion()
    solver: Solver = Solver()
    objects: Objects = Objects()
    object: list[ObjectTable] = msgspec.field(default_factory=list)
    simulator: Simulator = Simulator()
    viewer: Viewer = Viewer()
    recorder: Recorder = Recorder()
    metrics: Metrics = Metrics()
    bridges: Bridges = Bridges()
    folder: str = "."

    @property
    def calibration_dir(self) -> Path:
        """Folder of calibration/*.json."""
        return Path(self.folder) / self.rig.calibration

    @property
    def certificates_dir(self) -> Path:
        """Folder of this host's certificates; it need not exist."""
        return Path(self.folder) / self.bus.certificates

    @property
    def has_depth(self) -> bool:
        """Whether hands can be solved; with one camera, or no hand, markers alone are tracked."""
        return len(self.camera) >= 2 and bool(self.hand)

    def camera_named(self, name: str) -> CameraTable:
        """The [[camera]] table of that name."""
        for camera in self.camera:
            if camera.name == name:
                return camera
        raise ConfigError(
            f"rig {self.rig.name!r} has no camera {name!r}; "
            f"it has {[c.name for c in self.camera]}. Add a [[camera]] table to rig.toml"
        )

    @property
    def colors(self) -> list[str]:
        """Every colour some marker uses: those of the hands, and of the objects' trackers."""
        of_objects = {item.marker for item in self.object if item.marker}
        return sorted(of_objects.union(self.hand_colors))

    @property
    def hand_colors(self) -> list[str]:
        """Every colour some hand's marker uses."""
        return sorted({color for hand in self.hand.values() for color in hand.markers.values()})

    def markers_of(self, colors: Iterable[str]) -> list[str]:
        """What the markers of colours are called in messages: as the colour, but for dots."""
        dots = self.dots
        return [name for color in colors for name in dots.get(color, {"": color}).values()]

    @property
    def dots(self) -> dict[str, dict[str, str]]:
        """Of each colour that several landmarks share: their markers' names by landmark."""
        found: dict[str, dict[str, str]] = {}
        for table in self.hand.values():
            for landmark, name in table.marker_names.items():
                if name != table.markers[landmark]:
                    found.setdefault(table.markers[landmark], {})[landmark] = name
        return found

    @property
    def landmarks(self) -> dict[str, tuple[str, str]]:
        """Of each colour that marks one landmark, its hand and the landmark."""
        return {
            color: (hand, landmark)
            for hand, table in self.hand.items()
            for landmark, color in table.markers.items()
            if color not in self.dots
        }

    def color_of(self, marker: str) -> str:
        """The colour of a marker of that name: its own name, but of dots that share a colour."""
        for color, names in self.dots.items():
            if marker in names.values():
                return color
        return marker

    def wearer(self, color: str) -> str:
        """What carries a colour, for people: "the cup's tracker"; "" if nothing does."""
        if color in self.dots:
            return f"the dots of one colour ({len(self.dots[color])} joints)"
        for hand, table in self.hand.items():
            for landmark, own in table.marker_names.items():
                if own == color:
                    return f"the {hand} hand's {landmark.replace('_', ' ')}"
        return next((f"the {o.name}'s tracker" for o in self.object if o.marker == color), "")

    def counted(self, colors: Iterable[str]) -> list[str]:
        """Of a camera's markers those that tell how well it sees: the hands'. An object's tracker
        turns its paint away as it likes; without a hand all count.
        """
        own = {name for hand in self.hand.values() for name in hand.marker_names.values()}
        return [name for name in colors if name in own or not own]

    def tracked_colors(self, calibrated: Iterable[str]) -> list[str]:
        """What a tracker looks for: markers' colours, and without a hand all calibrated ones."""
        return self.colors if self.hand else sorted({*self.colors, *calibrated})

    def rate_hz(self, rate: Rate, camera: str | None = None) -> float:
        """Expected rate of a stream; 0 where there is none."""
        fastest = max((c.fps for c in self.camera), default=0.0)
        match rate:
            case Rate.CAMERA:
                return self.camera_named(camera).fps if camera else fastest
            case Rate.HAND:
                return fastest
            case Rate.OBJECT:
                return self.objects.rate_hz
            case Rate.BEAT:
                return 1.0
            case Rate.DEMAND:
                return 0.0


def load_rig(path: str | Path) -> RigConfig:
    """Read and check rig.toml.

    Raises ConfigError naming the file, the field, what is allowed and the nearest valid name.
    """
    path = Path(path)
    data = _read_toml(path)
    if "folder" in data:
        raise ConfigError(f"{path}: unknown key `folder`")
    config: RigConfig = msgspec.structs.replace(_convert(data, path), folder=str(path.parent))
    for hand, table in config.hand.items():
        if wrong := joints_problem(table):
            raise ConfigError(f"{path}: [hand.{hand}]: {wrong}")
    config = with_joints(config)
    _check(config, path)
    return config


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: no such file; config/sim.toml and config/rig.example.toml are ready to copy"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from None
    except RecursionError:
        raise ConfigError(f"{path}: not valid TOML: brackets in brackets without end") from None


def _convert(data: dict[str, Any], path: Path) -> RigConfig:
    try:
        return msgspec.convert(data, RigConfig)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{path}: {explain(str(error), RigConfig)}") from None


def with_joints(config: RigConfig) -> RigConfig:
    """The same with `joints` of each hand written out as markers."""
    hands: dict[Literal["left", "right"], HandTable] = {}
    for hand, table in config.hand.items():
        written = dict(table.markers)
        if table.joints is not None:
            for finger in table.fingers or DIGITS:
                for index in CHAIN_JOINTS[DIGITS.index(finger)]:
                    written.setdefault(JOINTS[index], table.joints)
        hands[hand] = msgspec.structs.replace(table, markers=written)
    return msgspec.structs.replace(config, hand=hands)


def _check(config: RigConfig, path: Path) -> None:
    """Rules that one field alone cannot say."""
    _unique([c.name for c in config.camera], "[[camera]] name", path)
    _unique([o.name for o in config.object], "[[object]] name", path)
    _unique([o.serial for o in config.object], "[[object]] serial", path)
    for hand, table in config.hand.items():
        if wrong := markers_problem(table):
            raise ConfigError(f"{path}: [hand.{hand}.markers]: {wrong}")
    _unique(
        [
            *(c for h in HANDS if h in config.hand for c in set(config.hand[h].markers.values())),
            *(item.marker for item in config.object if item.marker),
        ],
        "colour of all hands and objects together",
        path,
    )
    for item in config.object:
        if wrong := shape_problem(item):
            raise ConfigError(f"{path}: [[object]] {item.name!r}: {wrong}")
    if wrong := access_problem(config.viewer):
        raise ConfigError(f"{path}: {wrong}")


def _unique(names: list[str], what: str, path: Path) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigError(f"{path}: {what} {twice[0]!r} is used twice; each must be its own")
