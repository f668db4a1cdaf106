"""What of a marker is told that the picture's edge cuts.

    python benchmarks/cut_markers.py [--tuning] [--recipes 6] [--json FILE]

Pictures of testing/families, a side of which is cut away at two lines through the hand, each side
in turn. Markers: against those of the whole picture, px across the edge, by how much of a disc of
the marker's area shows. Points: of landmarks that one camera or both see cut, mm against the truth,
through fusion and solver. Rooms without things in the paints' colours: elsewhere these are taken
for what is outside. `as measured`: the centre of what is left, and that it is cut counts in sigma.
"""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import msgspec
import numpy as np
from held_out_score import make_fusion, run

from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array
from rhot.hand import default_hand
from rhot.messages import Marker, MarkerFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.measure.cut_marker import CutMarkers, part_of
from services.pi_tracker.rig_step import step_of_rig
from testing.families.case import Case, Half
from testing.families.cropped import Crop, crops_through
from testing.families.picture_catalog import recipes
from testing.families.pictures import CLOCK_SIGMA_NS, PaintMiddles, Recipe, fitted_colors, taken
from testing.point_errors import THREE_SIGMAS, squared_distances

LAGS, CUT_AT = (0, 2), (0.3, 0.7)
WAYS = ("rhot", "as measured")
# Of a disc, how much shows.
SHOWS = ((0.9, 0.999), (0.7, 0.9), (0.5, 0.7), (0.3, 0.5), (0.1, 0.3))
# A landmark counts as cut where a look so near in time is.
NEAR_S = 0.025
Shots = dict[str, list[tuple[float, Frame]]]
Figures = dict[str, float]


@contextlib.contextmanager
def going(way: str) -> Iterator[None]:
    """Cut markers restored, or left as they are measured."""
    if way == "rhot":
        yield
        return
    with patch.object(
        CutMarkers, "restored", lambda _self, measured, *_: [one for _, one in measured.values()]
    ):
        yield


class Cut:
    """A recipe's pictures, and what is found in them and in what is left of them."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe, self.scene = recipe, recipe.scene()
        calibration = recipe.scene(seed=recipe.seed + 1000)
        self.colors = {name: fitted_colors(calibration, name) for name in self.scene.cameras}
        self.shots: Shots = {
            name: list(taken(recipe, self.scene, name)) for name in self.scene.cameras
        }
        self.whole = {name: self.found(name, None) for name in self.scene.cameras}
        places = [
            (marker.x_px, marker.y_px)
            for frames in self.whole.values()
            for frame in frames
            for marker in frame.markers
        ]
        self.crops = crops_through(np.array(places), CUT_AT)

    def found(self, camera: str, crop: Crop | None) -> list[MarkerFrame]:
        """Markers of a camera's pictures, or of what is left of them."""
        frames = [frame for _, frame in self.shots[camera]]
        if crop is not None:
            frames = [crop.of_frame(frame) for frame in frames]
        step = step_of_rig(self._config(crop), camera, self.colors[camera])
        return [step.step(frame, 0, CLOCK_SIGMA_NS) for frame in frames]

    def case(self, crop: Crop, found: dict[str, list[MarkerFrame]]) -> Case:
        """What fusion is given of what is left."""
        hand, times = self.recipe.hand(), []
        for name, frames in found.items():
            times += list(zip([at_s for at_s, _ in self.shots[name]], frames, strict=True))
        landmarks = tuple(self.scene.hands[hand.hand].landmarks)
        cameras = {name: crop.of_camera(one) for name, one in self.scene.cameras.items()}
        ordered = [frame for _, frame in sorted(times, key=lambda entry: entry[0])]
        return Case(
            name="",
            config=self._config(crop),
            cameras=cameras,
            hands={hand.hand: default_hand(hand.hand, self.recipe.given_scale)},
            frames=ordered,
            visible=np.ones((len(ordered), len(landmarks))),
            landmarks=landmarks,
            truth=PaintMiddles(self.scene, hand, landmarks),
            seconds=self.recipe.seconds,
            clock_errors_s={
                name: 1e-9 * clock.residual_ns for name, clock in self.scene.clocks.items()
            },
        )

    def _config(self, crop: Crop | None) -> RigConfig:
        config = self.scene.config
        if crop is None:
            return config
        tables = [
            msgspec.structs.replace(one, size_px=crop.size_px(one.size_px)) for one in config.camera
        ]
        return msgspec.structs.replace(config, camera=tables)


def within_radii(marker: Marker, crop: Crop) -> float:
    """How far a marker's middle is within the edge, in radii of a disc of its area."""
    inside_px = crop.inside_px(np.array([marker.x_px, marker.y_px]))
    return inside_px / max(float(np.sqrt(marker.area_px / np.pi)), 1e-9)


def marker_rows(cut: Cut, crop: Crop, found: dict[str, list[MarkerFrame]]) -> list[list[float]]:
    """Of markers that are cut: the share that shows, the error across the edge px, its sigma."""
    rows, origin = [], crop.origin_px()
    for name, frames in found.items():
        for whole, part in zip(cut.whole[name], frames, strict=True):
            told = {marker.color: marker for marker in part.markers}
            for marker in whole.markers:
                line = within_radii(marker, crop)
                if abs(line) >= 1.0:
                    continue
                row = [float(part_of(np.array(line))), np.nan, np.nan]
                if one := told.get(marker.color):
                    place = (one.x_px, one.y_px)[crop.axis] + origin[crop.axis]
                    row[1:] = place - (marker.x_px, marker.y_px)[crop.axis], one.sigma_px
                rows.append(row)
    return rows


def point_rows(
    cut: Cut, crop: Crop, found: dict[str, list[MarkerFrame]], lag: int
) -> tuple[Array, Array]:
    """Errors (n,) mm of points of cut landmarks, NaN where none is told; squared distances."""
    case = cut.case(crop, found)
    told = run(case, make_fusion(case, lag), feedback=True)
    colors = case.config.hand[case.hand].markers
    column = {colors[name]: number for number, name in enumerate(case.landmarks)}
    is_cut = np.zeros((len(told.instants_s), len(case.landmarks)), dtype=bool)
    for name, frames in cut.whole.items():
        for (at_s, _), frame in zip(cut.shots[name], frames, strict=True):
            near = np.abs(told.instants_s - at_s) < NEAR_S
            for marker in frame.markers:
                if abs(within_radii(marker, crop)) < 1.0:
                    is_cut[near, column[marker.color]] = True
    errors = (told.points_m - case.truth(told.instants_s))[is_cut]
    covariances = told.covariances_m2[is_cut]
    given = np.isfinite(errors).all(axis=1)
    squares = squared_distances(errors[given], covariances[given])
    return 1e3 * np.linalg.norm(errors, axis=1), squares


def figures(errors: Array, squares: Array) -> Figures:
    """Of errors, NaN where there was nothing, and squared errors over variance."""
    size = np.abs(errors[np.isfinite(errors)])
    found = {
        "count": len(errors),
        "told": 100.0 * len(size) / max(len(errors), 1),
        "rms": np.sqrt(np.mean(size**2)),
        "p95": np.percentile(size, 95.0),
        "max": size.max(),
        "nees": squares.mean(),
    }
    return {name: round(float(value), 3) for name, value in found.items()}


def measure(half: Half, count: int) -> dict[str, dict[str, dict[str, Figures]]]:
    """Figures of markers by what shows, and of points by lag, of each way."""
    of_half = [recipe for recipe in recipes(half).values() if not recipe.clutter]
    markers: dict[str, list[list[float]]] = {way: [] for way in WAYS}
    points = {way: {lag: ([], []) for lag in LAGS} for way in WAYS}
    for recipe in of_half[:: max(len(of_half) // count, 1)][:count]:
        cut = Cut(recipe)
        for crop in cut.crops:
            for way in WAYS:
                with going(way):
                    found = {name: cut.found(name, crop) for name in cut.shots}
                markers[way] += marker_rows(cut, crop, found)
                for lag in LAGS:
                    for kept, new in zip(
                        points[way][lag], point_rows(cut, crop, found, lag), strict=True
                    ):
                        kept.append(new)
    table: dict[str, dict[str, dict[str, Figures]]] = {"markers": {}, "points": {}}
    for way in WAYS:
        rows = np.array(markers[way])
        for low, high in SHOWS:
            of = rows[(rows[:, 0] >= low) & (rows[:, 0] < high)]
            squares = (of[:, 1] / of[:, 2])[np.isfinite(of[:, 1])] ** 2
            shows = f"{100 * low:.0f} to {100 * high:.0f} %"
            table["markers"].setdefault(shows, {})[way] = figures(of[:, 1], squares)
        for lag in LAGS:
            errors, squares = (np.concatenate(kept) for kept in points[way][lag])
            row = figures(errors, squares / 3.0)
            row["within"] = round(100.0 * float(np.mean(squares <= THREE_SIGMAS)), 2)
            table["points"].setdefault(str(lag), {})[way] = row
    return table


def main() -> None:
    """Print both tables, and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tuning", action="store_true", help="the half that is no evidence")
    parser.add_argument("--recipes", type=int, default=6, help="so many of the half's")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    half: Half = "tuning" if options.tuning else "held_out"
    table = measure(half, options.recipes)
    for what, rows in table.items():
        names = list(next(iter(rows.values()))["rhot"])
        print(f"\n{what + ', ' + half + ' half':26}" + "".join(f"{name:>9}" for name in names))
        for row, ways in rows.items():
            for way, values in ways.items():
                cells = "".join(f"{values[name]:9.2f}" for name in names)
                print(f"{row:14}{way:12}{cells}")
    if options.json:
        options.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
