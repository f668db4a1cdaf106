"""What `rhot calibrate lens`, `stereo` and `refine` print: the figures that matter first, then
picture by picture. Pure text.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.geometry.transforms import Array, inverse
from services.calibrator.board.board import Board
from services.calibrator.board.board_views import LeftOut
from services.calibrator.bundle.lens_model import FX, FY, distortion_of
from services.calibrator.lens.result import LensResult
from services.calibrator.recalibrate.refine_rig import RefinedRig
from services.calibrator.rig.result import RigResult


def lens_text(result: LensResult, board: Board) -> str:
    """The report of `rhot calibrate lens`."""
    seen = result.coverage
    size = "{}x{}".format(*result.size_px)
    held_out_mm = 1e3 * board.square_m * result.held_out_squares
    held_out = (
        f"{result.held_out_px:.3f} px, {result.held_out_squares:.4f} squares = "
        f"{held_out_mm:.3f} mm on the board"
    )
    tilts = f"tilts {min(seen.tilt_deg):.0f} to {max(seen.tilt_deg):.0f} degrees"
    lines = [
        f"camera {result.camera}, {size} px, {len(result.pictures)} pictures, board {board.name}",
        f"  lens          {_lens(result.lens, result.sigma)}, distortion {result.model}",
        f"  RMS           {result.rms_px:.3f} px",
        f"  held out      {held_out}",
        f"  coverage      {100 * seen.share:.0f} % of the image, {tilts}",
        *("    " + row for row in seen.drawing().splitlines()),
        "  picture           RMS px   held out px   squares   pull on the others",
    ]
    lines += [
        f"  {each.key:<16} {each.rms_px:>7.3f} {each.held_out_px:>13.3f} "
        f"{each.held_out_squares:>9.4f} {_pull(each.influence_percent, each.suspect)}"
        for each in result.pictures
    ]
    return "\n".join([*lines, *_notes(result.left_out, result.warnings)])


def rig_text(result: RigResult) -> str:
    """The report of `rhot calibrate stereo`."""
    lines = _rig_summary(result)
    for k, name in enumerate(result.cameras):
        lens = _lens(result.state.lenses[k], result.lens_sigma[k])
        known = f"distortion {result.model}, RMS {result.camera_rms_px[k]:.3f} px"
        lines.append(f"  camera {name}: {lens}, {known}")
        if k:
            lines.append(
                f"    {_place(result.state.T_camera_from_rig[k], result.extrinsics_sigma[k])}"
            )
        lines.append(f"    corners cover {100 * result.coverage[k].share:.0f} % of the image")
        lines += ["      " + row for row in result.coverage[k].drawing().splitlines()]
    lines.append(
        "  position          RMS px   held out: squares   square side   epipolar px   at mm   "
        "pull on the others"
    )
    lines += [_position(result, number) for number in range(len(result.positions))]
    return "\n".join([*lines, *_notes(result.left_out, result.warnings)])


def _rig_summary(result: RigResult) -> list[str]:
    square_mm = 1e3 * result.board.square_m
    fit_mm = square_mm * result.held_out_squares
    side = f"{square_mm * result.square_ratio:.3f} mm of {square_mm:g} mm"
    several = sum(1 for position in result.positions if position.held_out)
    positions = f"{len(result.positions)} positions ({several} seen by two cameras)"
    board_fit = f"{result.held_out_squares:.4f} squares = {fit_mm:.3f} mm"
    ratios = f"{_percent(result.square_ratio)}, worst {_percent(result.square_worst)}"
    return [
        f"rig of {', '.join(result.cameras)}, {positions}, {result.board.name}",
        f"  stereo RMS           {result.rms_px:.3f} px",
        f"  held-out board fit   {board_fit}, {result.held_out_px:.3f} px",
        f"  held-out square      {side}: {ratios}",
        f"  held-out epipolar    {result.epipolar_px:.3f} px",
    ]


def _position(result: RigResult, number: int) -> str:
    """One board position's line."""
    position = result.positions[number]
    error = position.held_out
    figures = f"{'seen by one camera only':>55}"
    if error:
        figures = (
            f"{error.fit_squares:>19.4f} {_percent(error.square_ratio):>13} "
            f"{error.epipolar_px:>13.3f} {1e3 * error.distance_m:>7.0f}"
        )
    pull = _pull(position.influence_percent, position.suspect)
    return f"  {position.key:<16} {position.rms_px:>7.3f} {figures} {pull}"


def refined_text(result: RefinedRig) -> str:
    """The report of `rhot calibrate refine`."""
    before_px, after_px = result.epipolar_before_px, result.epipolar_px
    cameras, seconds = ", ".join(result.cameras), f"{result.seconds:.0f} s"
    lines = [
        f"rig of {cameras}, {result.points} marker points in {seconds}",
        f"  held-out epipolar    {after_px:.3f} px, before {before_px:.3f} px",
    ]
    if result.wand_mm is not None:
        before_mm, after_mm = result.wand_mm
        lines.append(f"  held-out wand        {after_mm:.2f} mm off, before {before_mm:.2f} mm")
    else:
        lines.append(
            "  scale                kept: the distance of the first two cameras is taken as it was "
            "(a wand would measure it)"
        )
    for name, change in result.changes.items():
        rotation = _with_sigmas(change.rotation_deg, change.rotation_sigma_deg)
        shift = _with_sigmas(change.shift_mm, change.shift_sigma_mm)
        lines.append(
            f"  camera {name}: turned about its x, y, z by {rotation} deg, shifted by {shift} mm; "
            f"stamps late by {change.delay_ms:.2f} ms"
        )
    return "\n".join(lines)


def _with_sigmas(values: Array, sigmas: Array) -> str:
    return ", ".join(
        f"{value:.2f} +- {sigma:.2f}" for value, sigma in zip(values, sigmas, strict=True)
    )


def _lens(lens: Array, sigma: Array) -> str:
    known = f" +- {max(sigma[FX], sigma[FY]):.1f}" if np.any(sigma) else ""
    k = " ".join(f"{value:.3g}" for value in distortion_of(lens))
    return (
        f"f {lens[FX]:.1f}, {lens[FY]:.1f}{known} px, centre {lens[2]:.1f}, {lens[3]:.1f} px, ({k})"
    )


def _place(T_camera_from_rig: Array, sigma: Array) -> str:
    p = 1e3 * inverse(T_camera_from_rig)[:3, 3]
    cosine = (np.trace(T_camera_from_rig[:3, :3]) - 1.0) / 2.0
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    at = f"{p[0]:.1f}, {p[1]:.1f}, {p[2]:.1f} mm (+- {1e3 * sigma[3:].max():.1f})"
    distance = f"{np.linalg.norm(p):.1f} mm from the first camera"
    return f"at {at}, {distance}, turned {angle:.2f} degrees"


def _percent(ratio: float) -> str:
    return f"{100.0 * (ratio - 1.0):+.2f} %"


def _pull(percent: float, hurts: bool) -> str:
    return f"{percent:>10.1f} %{'   <- hurts' if hurts else ''}"


def _notes(left_out: Sequence[LeftOut], warnings: Sequence[str]) -> list[str]:
    lines = [
        f"  left out: {f'{item.camera} {item.key}'.strip()}: {item.reason}" for item in left_out
    ]
    return lines + [f"  warning: {warning}" for warning in warnings]
