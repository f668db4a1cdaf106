"""What `rhot calibrate` prints: the figures that matter first, then picture by picture.

Pure text.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.geometry.transforms import Array, inverse
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut
from services.calibrator.bundle.lens_model import FX, FY, K1
from services.calibrator.lens.result import LensResult
from services.calibrator.recalibrate.refine_rig import Refined
from services.calibrator.rig.result import RigResult


def lens_text(result: LensResult, board: Board) -> str:
    """The report of `rhot calibrate lens`."""
    seen, held_out_mm = result.coverage, 1e3 * board.square_m * result.held_out_squares
    lines = [
        f"camera {result.camera}, {result.size_px[0]}x{result.size_px[1]} px, {len(result.pictures)} pictures, board {board.name}",
        f"  lens          {_lens(result.lens, result.sigma)}, distortion {result.model}",
        f"  RMS           {result.rms_px:.3f} px",
        f"  held out      {result.held_out_px:.3f} px, {result.held_out_squares:.4f} squares = {held_out_mm:.3f} mm on the board",
        f"  coverage      {100 * seen.share:.0f} % of the image, tilts {min(seen.tilt_deg):.0f} to {max(seen.tilt_deg):.0f} degrees",
        *("    " + row for row in seen.drawing().splitlines()),
        "  picture           RMS px   held out px   squares   pull on the others",
    ]
    lines += [
        f"  {each.key:<16} {each.rms_px:>7.3f} {each.held_out_px:>13.3f} {each.held_out_squares:>9.4f} "
        f"{each.influence_percent:>10.1f} %{_hurts(each.suspect)}"
        for each in result.pictures
    ]
    return "\n".join([*lines, *_notes(result.left_out, result.warnings)])


def rig_text(result: RigResult) -> str:
    """The report of `rhot calibrate stereo`."""
    square_mm = 1e3 * result.board.square_m
    held_out = [position for position in result.positions if position.held_out]
    fit_mm = square_mm * result.held_out_squares
    side = f"{square_mm * result.square_ratio:.3f} mm"
    lines = [
        f"rig of {', '.join(result.cameras)}, {len(result.positions)} positions ({len(held_out)} seen by two cameras), {result.board.name}",
        f"  stereo RMS           {result.rms_px:.3f} px",
        f"  held-out board fit   {result.held_out_squares:.4f} squares = {fit_mm:.3f} mm, {result.held_out_px:.3f} px",
        f"  held-out square      {side} of {square_mm:g} mm: {_percent(result.square_ratio)}, worst {_percent(result.square_worst)}",
        f"  held-out epipolar    {result.epipolar_px:.3f} px",
    ]
    for k, name in enumerate(result.cameras):
        known = f"distortion {result.model}, RMS {result.camera_rms_px[k]:.3f} px"
        lines.append(
            f"  camera {name}: {_lens(result.state.lenses[k], result.lens_sigma[k])}, {known}"
        )
        if k:
            lines.append(
                f"    {_place(result.state.T_camera_from_rig[k], result.extrinsics_sigma[k])}"
            )
        lines.append(f"    corners cover {100 * result.coverage[k].share:.0f} % of the image")
        lines += ["      " + row for row in result.coverage[k].drawing().splitlines()]
    lines.append(
        "  position          RMS px   held out: squares   square side   epipolar px   at mm   pull on the others"
    )
    for position in result.positions:
        error = position.held_out
        figures = (
            f"{error.fit_squares:>19.4f} {_percent(error.square_ratio):>13} {error.epipolar_px:>13.3f} {1e3 * error.distance_m:>7.0f}"
            if error
            else f"{'seen by one camera only':>55}"
        )
        lines.append(
            f"  {position.key:<16} {position.rms_px:>7.3f} {figures} {position.influence_percent:>10.1f} %{_hurts(position.suspect)}"
        )
    return "\n".join([*lines, *_notes(result.left_out, result.warnings)])


def refined_text(result: Refined) -> str:
    """The report of `rhot calibrate refine`."""
    lines = [
        f"rig of {', '.join(result.cameras)}, {result.points} marker points in {result.seconds:.0f} s",
        f"  held-out epipolar    {result.epipolar_px:.3f} px, before {result.epipolar_before_px:.3f} px",
    ]
    if result.wand_mm is not None:
        lines.append(
            f"  held-out wand        {result.wand_mm[1]:.2f} mm off, before {result.wand_mm[0]:.2f} mm"
        )
    else:
        lines.append(
            "  scale                kept: the distance of the first two cameras is taken as it was (a wand would measure it)"
        )
    for name, moved in result.moved.items():
        turned, shifted = (
            _three(*pair)
            for pair in (
                (moved.turned_deg, moved.turned_sigma_deg),
                (moved.shifted_mm, moved.shifted_sigma_mm),
            )
        )
        lines.append(
            f"  camera {name}: turned about its x, y, z by {turned} deg, shifted by {shifted} mm; stamps late by {moved.late_ms:.2f} ms"
        )
    return "\n".join(lines)


def _three(values: Array, sigmas: Array) -> str:
    return ", ".join(
        f"{value:.2f} +- {sigma:.2f}" for value, sigma in zip(values, sigmas, strict=True)
    )


def _lens(lens: Array, sigma: Array) -> str:
    known = f" +- {max(sigma[FX], sigma[FY]):.1f}" if np.any(sigma) else ""
    k = " ".join(f"{value:.3g}" for value in lens[K1:])
    return (
        f"f {lens[FX]:.1f}, {lens[FY]:.1f}{known} px, centre {lens[2]:.1f}, {lens[3]:.1f} px, ({k})"
    )


def _place(T_camera_from_rig: Array, sigma: Array) -> str:
    p = 1e3 * inverse(T_camera_from_rig)[:3, 3]
    angle = np.degrees(
        np.arccos(np.clip((np.trace(T_camera_from_rig[:3, :3]) - 1.0) / 2.0, -1.0, 1.0))
    )
    return (
        f"at {p[0]:.1f}, {p[1]:.1f}, {p[2]:.1f} mm (+- {1e3 * sigma[3:].max():.1f}), {np.linalg.norm(p):.1f} mm from the first camera, "
        f"turned {angle:.2f} degrees"
    )


def _percent(ratio: float) -> str:
    return f"{100.0 * (ratio - 1.0):+.2f} %"


def _hurts(hurts: bool) -> str:
    return "   <- hurts" if hurts else ""


def _notes(left_out: Sequence[LeftOut], warnings: Sequence[str]) -> list[str]:
    lines = [
        f"  left out: {f'{item.camera} {item.key}'.strip()}: {item.reason}" for item in left_out
    ]
    return lines + [f"  warning: {warning}" for warning in warnings]
