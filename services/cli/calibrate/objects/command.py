"""`rhot calibrate objects [NAME...]`: where the lighthouses' frame is in the rig, from paint on a
tracker that is moved and turned before the cameras; live, from a recording, or from points measured
by other means.

calibration/objects.json is written once all is computed; weak data is refused with the reason, and
nothing is written.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from rhot.errors import CalibrationError
from rhot.files.calibration import ObjectPlace, Objects, load_objects, load_rig_cameras, save
from rhot.files.config import RigConfig
from services.calibrator.objects.wanted import (
    Painted,
    Place,
    note_on_colors,
    painted_objects,
    places_of,
    same_place,
)
from services.cli.calibrate import options
from services.cli.option_groups import grouped
from services.cli.options import ConnectOption
from services.cli.router_session import rig_and_endpoints

if TYPE_CHECKING:
    from services.calibrator.objects.recorded import Recorded


@dataclass(frozen=True)
class SourceOptions:
    """What the registration is made of; live if nothing is given."""

    marker: Annotated[
        str | None,
        typer.Option(metavar="COLOR", help="the paint on the tracker; default: rig.toml's"),
    ] = None
    seconds: Annotated[
        float, typer.Option(min=3.0, max=300.0, help="how long to move the tracker at least")
    ] = 20.0
    recording: Annotated[
        Path | None,
        typer.Option(help="a capture, a folder with markers.jsonl and objects.jsonl, or an .mcap"),
    ] = None
    poses: Annotated[
        Path | None,
        typer.Option(help="poses of the trackers, with --points, or instead of the recording's"),
    ] = None
    points: Annotated[
        Path | None,
        typer.Option(
            help="reference points in the rig frame, CSV: x,y,z or stamp_ns,x,y,z in m; or a "
            "folder of a laser tracker's points with poses"
        ),
    ] = None


@dataclass(frozen=True)
class PlaceOptions:
    """Where objects sit on their trackers."""

    offset: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]X,Y,Z", help="the object's origin on its tracker, metres; repeatable"
        ),
    ] = None
    turn: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]X,Y,Z",
            help="how the object is turned on it: degrees about x, then y, then z; repeatable",
        ),
    ] = None
    place_only: Annotated[
        bool,
        typer.Option("--place-only", help="only write --offset and --turn, do not register anew"),
    ] = False


@grouped
def objects(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]...", help="objects of rig.toml; default: all with paint"),
    ] = None,
    config: options.ConfigOption = None,
    *,
    source: SourceOptions,
    place: PlaceOptions,
    check: Annotated[
        bool, typer.Option("--check", help="measure how well the registration fits; write nothing")
    ] = False,
    out: options.OutOption = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only report, write nothing")] = False,
    connect: ConnectOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Register trackers to the rig: move a painted tracker before the cameras, live, or give a
    recording of it.
    """
    rig, endpoints = rig_and_endpoints(config, connect)
    path = options.out_folder(out, rig) / "objects.json"
    before = _there(path.parent) or _there(rig.calibration_dir)
    job = _Job(rig, endpoints, list(names or []), source, config, before)
    places = places_of(rig, job.names, place.offset or [], place.turn or [])
    if check:
        job.check(as_json=as_json)
        return
    if place.place_only:
        made, text = _only_placed(before, places, path), "the registration stays as it was"
    elif source.points:
        made, text = job.from_points(source.points)
    else:
        made, text = job.from_paint()
    made = _placed(made, places)
    if not dry_run:
        save(path, made)
    if as_json:
        options.echo_json(made)
        return
    typer.echo(text)
    for name in same_place(made.objects, [table.name for table in rig.object]):
        typer.echo(
            f"note: {name}'s origin is its tracker's own; if it is elsewhere: "
            f"`rhot calibrate objects {name} --place-only --offset X,Y,Z`"
        )
    if not dry_run:
        typer.echo(f"written: {path}; a running object tracker takes it at once")


@dataclass(frozen=True)
class _Job:
    """What is registered, from what."""

    rig: RigConfig
    endpoints: list[str]
    names: list[str]
    source: SourceOptions
    config: Path | None
    before: Objects | None

    def from_paint(self) -> tuple[Objects, str]:
        """The file, and the report."""
        from services.calibrator.objects.register import register
        from services.calibrator.output.objects_file import objects_file
        from services.calibrator.output.objects_report import objects_text

        painted = self._painted()
        cameras = load_rig_cameras(self.rig)
        recorded = self._recorded(painted, self.source.seconds)
        found = register(recorded.sightings(cameras, painted), recorded.paths())
        names = {one.serial: one.name for one in painted}
        others = [table.name for table in self.rig.object]
        made = options.now_text(), self._inputs({one.name: one.color for one in painted})
        return objects_file(found, names, self.before, others, made), objects_text(found, names)

    def from_points(self, measured: Path) -> tuple[Objects, str]:
        """The same from points that were measured by other means: a file, or a folder."""
        from services.calibrator.objects.laser_points import read_experiment, register_laser
        from services.calibrator.objects.points import register_points
        from services.calibrator.output.objects_file import points_file
        from services.calibrator.output.objects_report import points_text
        from services.cli.calibrate.objects.points import poses_at, read_points
        from services.cli.calibrate.objects.recording import read_poses

        name, serial = self._only_one()
        if measured.is_dir():
            experiment = read_experiment(measured)
            laser = register_laser(experiment)
            middle_m = experiment.points_m.mean(axis=0)
            made = options.now_text(), self._inputs({})
            file = points_file(laser, name, "", middle_m, self.before, made)
            return file, points_text(laser, name)
        if self.source.poses is None:
            raise CalibrationError("--points needs --poses: the tracker's poses at these points")
        stamps_ns, points = read_points(measured)
        poses = read_poses(self.source.poses)
        at = poses_at(stamps_ns, len(points), poses, serial)
        found = register_points(points, at)
        universe = next(pose.universe for pose in poses if pose.device.serial == serial)
        made = options.now_text(), self._inputs({})
        file = points_file(found, name, universe, points.mean(axis=0), self.before, made)
        return file, points_text(found, name)

    def check(self, *, as_json: bool) -> None:
        """Report how well the registration fits what is seen now."""
        from services.cli.calibrate.objects.compare import disagreements

        if self.before is None:
            raise CalibrationError(
                "there is no objects.json to check; make it with `rhot calibrate objects`"
            )
        painted = self._painted()
        cameras = load_rig_cameras(self.rig)
        recorded = self._recorded(painted, min(self.source.seconds, 10.0), check=True)
        found = disagreements(recorded, cameras, painted, self.before)
        if as_json:
            typer.echo(msgspec.json.format(msgspec.json.encode(found), indent=1).decode())
            return
        for one in found:
            typer.echo(one.text())

    def _painted(self) -> list[Painted]:
        painted = painted_objects(self.rig, self.names, self.source.marker)
        for note in note_on_colors(self.rig, painted):
            typer.echo(f"note: {note}", err=True)
        return painted

    def _recorded(self, painted: list[Painted], seconds: float, *, check: bool = False) -> Recorded:
        from services.cli.calibrate.objects.live import Session, enough_motion, listen, nothing_more
        from services.cli.calibrate.objects.recording import read_recording

        if self.source.recording is not None:
            return read_recording(self.source.recording, self.source.poses, self.config)
        cameras = load_rig_cameras(self.rig)
        session = Session(self.rig.rig.name, self.endpoints, cameras, painted, seconds)
        return listen(session, nothing_more if check else enough_motion)

    def _only_one(self) -> tuple[str, str]:
        tables = [one for one in self.rig.object if not self.names or one.name in self.names]
        if len(tables) != 1:
            names = ", ".join(table.name for table in self.rig.object) or "none"
            raise CalibrationError(f"--points are of one object: name it; rig.toml has: {names}")
        return tables[0].name, tables[0].serial

    def _inputs(self, colors: dict[str, str]) -> dict[str, Any]:
        given = {"recording": self.source.recording, "poses": self.source.poses}
        given["points"] = self.source.points
        files = {key: str(value) for key, value in given.items() if value is not None}
        world = self.rig.rig.world
        return {
            "source": "recorded" if files else "live",
            **files,
            "markers": colors,
            # The registration holds for this frame of the rig only.
            "T_rig_from_camera": None if world is None else world.T_rig_from_camera,
        }


def _there(folder: Path) -> Objects | None:
    """A folder's objects.json, or None if it has none."""
    return load_objects(folder) if (folder / "objects.json").exists() else None


def _only_placed(before: Objects | None, places: dict[str, Place], path: Path) -> Objects:
    if not places:
        raise CalibrationError("--place-only needs --offset or --turn: there is nothing to write")
    if before is None:
        raise CalibrationError(
            f"{path}: no such file; register first, with `rhot calibrate objects`"
        )
    return before


def _placed(made: Objects, places: dict[str, Place]) -> Objects:
    changed = {
        name: place.on(made.objects.get(name, ObjectPlace())) for name, place in places.items()
    }
    return msgspec.structs.replace(made, objects={**made.objects, **changed})
