"""Lengths and angles in a finger's plane from one view: `python benchmarks/grasp_metrology.py
[--seeds N] [--json FILE]`.

Rendered views (k1 -0.18, k2 0.05): a finger of 40, 23 and 18 mm somewhere in the picture, its
joints and the reference rectangle's corners pointed at with noise; bones in per cent and MCP, PIP
and DIP angles in degrees, mean, 95 % and worst, by the camera's tilt and the noise:
    scale          pixels a millimetre of the rectangle's upper edge, lens and tilt left alone
    plane          the homography of the rectangle, lens left alone
    plane_lens     the same, lens from edges that are straight in the world (noise 0.3 px)
    edges_lens     the same lens; plane from the rectangle's edges, scale from its upper edge alone
    camera_lens    the same lens; the rectangle's plane as a camera of unknown focal length sees it
    calibrated     as a camera whose lens is calibrated sees it

Real photographs (`stereo_chessboard` of RHOT_DATA, both cameras, 13 pictures each): the board's
outer corners are seen, its 28 inner ones are not; all their distances are predicted from ONE
length, the upper border's. From 3 squares on a corner's own noise is small beside them.
    scale          pixels a square, lens and tilt left alone
    straight       lens from the borders of all pictures, each picture's focal length by itself
    straight_all   the same, with the focal length that all pictures agree on
    calibrated     lens from cv2.calibrateCamera
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.metrology.finger import finger_in_plane
from studies.grasp.metrology.lens import lens_from_edges, straightened
from studies.grasp.metrology.plane import (
    Plane,
    plane_from_length,
    plane_from_rectangle,
    plane_from_view,
    rectangle_mm,
)
from studies.grasp.metrology.pose import plane_seen_by_camera
from studies.grasp.metrology.segments import segment_of
from studies.grasp.metrology.view import PlaneView, common_lens, view_from_edges
from studies.grasp.scene.backdrop import Rectangle, straight_lines
from studies.grasp.scene.subjects import chain
from studies.grasp.scene.view import ViewOptions, place_camera

DATA = Path(os.environ.get("RHOT_DATA", Path(__file__).parents[2] / "shared" / "data"))
SIZE = (640, 480)
TILTS_DEG = (0.0, 5.0, 10.0, 20.0, 30.0)
NOISES_PX = (0.1, 0.5, 1.0)
BONES = (40.0, 23.0, 18.0)
EDGE_NOISE_PX = 0.3


def errors(found: Sequence[float] | Array) -> dict[str, float]:
    """Mean, 95 % and worst of absolute errors."""
    size = np.abs(np.asarray(found, dtype=float).ravel())
    return {
        "mean": round(float(size.mean()), 3),
        "p95": round(float(np.percentile(size, 95)), 3),
        "worst": round(float(size.max()), 3),
    }


def one_view(tilt_deg: float, noise_px: float, seed: int) -> dict[str, tuple[Array, Array]]:
    """Errors of bones (per cent) and angles (deg) of 20 fingers, by method."""
    rng = np.random.default_rng(seed)
    view = place_camera(ViewOptions(SIZE, tilt_deg=tilt_deg), seed)
    rectangle = Rectangle()
    corners = view.pixels(rectangle.corners) + rng.normal(0.0, noise_px, (4, 2))
    edges = [
        line + rng.normal(0.0, EDGE_NOISE_PX, line.shape)
        for line in straight_lines(view, rectangle, seed)
    ]
    lens = lens_from_edges(edges, SIZE)
    camera = view.camera

    def calibrated(px: Array) -> Array:
        return straightened(px, camera.matrix, camera.distortion)

    ways = {
        "scale": (lambda px: px, plane_from_length(corners[0], corners[1], rectangle.size[0])),
        "plane": (lambda px: px, plane_from_rectangle(corners, rectangle.size)),
        "plane_lens": (
            lens.straightened,
            plane_from_rectangle(lens.straightened(corners), rectangle.size),
        ),
        "edges_lens": (lens.straightened, by_edges(lens.straightened(corners), rectangle)),
        "camera_lens": (
            lens.straightened,
            by_camera(lens.straightened(corners), rectangle, noise_px, None),
        ),
        "calibrated": (
            calibrated,
            by_camera(calibrated(corners), rectangle, noise_px, camera.matrix),
        ),
    }
    places, angles = fingers(rng)
    seen = view.pixels(places.reshape(-1, 2)) + rng.normal(0.0, noise_px, (places.size // 2, 2))
    found = {}
    for name, (straighten, plane) in ways.items():
        of = finger_in_plane(plane, straighten(seen).reshape(-1, 6, 2), noise_px)
        turned = np.degrees(of.angles_rad - angles)
        found[name] = (100.0 * (of.lengths_mm / BONES - 1.0), (turned + 180.0) % 360.0 - 180.0)
    return found


def by_edges(corners: Array, rectangle: Rectangle) -> Plane:
    """From the four edges' directions, and the upper edge's length."""
    a, b, c, d = corners
    view = view_from_edges([[a, b], [d, c]], [[a, d], [b, c]], SIZE)
    return plane_from_view(view, a, b, rectangle.size[0])


def by_camera(corners: Array, rectangle: Rectangle, noise_px: float, matrix: Array | None) -> Plane:
    """As `rhot grasp measure --reference` has it."""
    mm = rectangle_mm(*rectangle.size)
    return plane_seen_by_camera(corners, mm, SIZE, sigma_px=noise_px, matrix=matrix)


def fingers(rng: np.random.Generator) -> tuple[Array, Array]:
    """Places (20, 6, 2) mm: base line, MCP, PIP, DIP, tip; and angles (20, 3)."""
    places, angles = [], []
    for _ in range(20):
        bent = np.radians(rng.uniform((0.0, 5.0, 0.0), (85.0, 105.0, 70.0)))
        at = rng.uniform((-25.0, -10.0), (5.0, 5.0))
        joints = chain(BONES, bent, (0.0, 0.0))
        places.append(at + np.concatenate([[(-42.0, 0.0), (0.0, 0.0)], joints]))
        angles.append(bent)
    return np.array(places), np.array(angles)


def rendered(seeds: int) -> dict[str, dict]:
    """All tilts and noises."""
    found: dict[str, dict] = {}
    for tilt in TILTS_DEG:
        for noise in NOISES_PX:
            views = [one_view(tilt, noise, seed) for seed in range(1, seeds + 1)]
            figures = {
                name: {
                    "length_percent": errors(np.concatenate([one[name][0] for one in views])),
                    "angle_deg": errors(np.concatenate([one[name][1] for one in views])),
                }
                for name in views[0]
            }
            found[f"tilt {tilt:g} deg, noise {noise:g} px"] = figures
            print(f"\ntilt {tilt:g} deg, noise {noise:g} px", flush=True)
            for name, row in figures.items():
                print(f"  {name:12}" + "".join(f"  {kind} {row[kind]}" for kind in row))
    return found


def corners_of(path: Path) -> Array:
    """A board's inner corners (6, 9, 2) px."""
    gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(gray, (9, 6))
    if not found:
        raise SystemExit(f"{path}: no chessboard is seen")
    corners = np.ascontiguousarray(np.asarray(corners, np.float32).reshape(-1, 1, 2))
    fine = cv2.cornerSubPix(gray, corners, (5, 5), (-1, -1), (3, 50, 1e-4))
    return np.asarray(fine, dtype=float).reshape(6, 9, 2)


def border(board: Array) -> list[Array]:
    """Upper and lower border along x, left and right along y."""
    return [board[0], board[-1], board[:, 0], board[:, -1]]


def photographed(folder: Path, side: str) -> dict[str, dict]:
    """One camera's 13 pictures."""
    boards = [corners_of(path) for path in sorted(folder.glob(f"{side}*.jpg"))]
    lens = lens_from_edges([edge for board in boards for edge in border(board)], SIZE)
    straight = [lens.straightened(board).reshape(6, 9, 2) for board in boards]
    alone = [view_of(board, None) for board in straight]
    matrix = common_lens(alone, SIZE)
    K, distortion = calibration(boards)
    flat = [straightened(board, K, distortion).reshape(6, 9, 2) for board in boards]
    ways = {
        "scale": [plane_from_length(board[0, 0], board[0, -1], 8.0) for board in boards],
        "straight": planes(straight, alone),
        "straight_all": planes(straight, [view_of(board, matrix) for board in straight]),
        "calibrated": planes(flat, [view_of(board, K) for board in flat]),
    }
    shown = {"scale": boards, "calibrated": flat}
    found = {}
    for name, of in ways.items():
        rows = [
            predicted(plane, board)
            for plane, board in zip(of, shown.get(name, straight), strict=True)
        ]
        all_of, far = (np.concatenate([row[part] for row in rows]) for part in (0, 1))
        found[name] = {
            "all": {"median": round(float(np.median(np.abs(all_of))), 3), **errors(all_of)},
            "3_squares_on": {"median": round(float(np.median(np.abs(far))), 3), **errors(far)},
            "worst_picture_median": round(max(float(np.median(np.abs(r[0]))) for r in rows), 3),
        }
        print(f"  {name:12}  {found[name]}", flush=True)
    return found


def view_of(board: Array, matrix: Array | None):
    """By the board's border."""
    upper, lower, left, right = (segment_of(edge) for edge in border(board))
    return view_from_edges([upper, lower], [left, right], SIZE, sigma_px=0.2, matrix=matrix)


def planes(boards: Sequence[Array], views: Sequence[PlaneView]) -> list[Plane]:
    """A square is the unit: the upper border is 8 of them."""
    return [
        plane_from_view(view, board[0, 0], board[0, -1], 8.0, 0.2)
        for board, view in zip(boards, views, strict=True)
    ]


def calibration(boards: Sequence[Array]) -> tuple[Array, Array]:
    """OpenCV's: matrix (3, 3) and distortion (5,)."""
    grid = np.zeros((54, 3), np.float32)
    grid[:, :2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2)
    pixels = [board.reshape(-1, 1, 2).astype(np.float32) for board in boards]
    fixed = cv2.CALIB_FIX_K3
    _, K, k, _, _ = cv2.calibrateCamera([grid] * len(boards), pixels, SIZE, None, None, flags=fixed)
    return K, np.resize(np.append(k.ravel(), 0.0), 5)


def predicted(plane: Plane, board: Array) -> tuple[Array, Array]:
    """Errors of the inner corners' distances, per cent: all of them, and those of 3 squares on."""
    i, j = np.triu_indices(28, 1)
    grid = np.stack(np.meshgrid(np.arange(7.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    squares = plane.to_mm(board[1:-1, 1:-1])
    wanted = np.hypot(*(grid[i] - grid[j]).T)
    off = 100.0 * (np.hypot(*(squares[i] - squares[j]).T) / wanted - 1.0)
    return off, off[wanted >= 3.0]


def main() -> int:
    """Run, print, and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=10, help="views of each tilt and noise")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    found: dict[str, dict] = {"rendered": rendered(options.seeds)}
    folder = DATA / "stereo_chessboard"
    for side in ("left", "right"):
        if folder.is_dir():
            print(f"\nphotographed, {side} camera, per cent")
            found[side] = photographed(folder, side)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
