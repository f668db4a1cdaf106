"""`rhot calibrate depth bench.csv`: k, z and phi of the seed's depth law from measured distances,
or from its bench, simulated.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import typer

from rhot.errors import CalibrationError
from rhot.files.calibration import load_rig_cameras
from rhot.files.config import load_rig
from services.cli.calibrate.options import JsonOption


def depth(
    table: Annotated[
        Path | None, typer.Argument(metavar="CSV", help="columns distance_cm,disparity_px")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config", help="rig.toml, for focal length and baseline; default: the seed's"
        ),
    ] = None,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="the seed's bench, simulated, instead of a CSV")
    ] = False,
    divergence_deg: Annotated[
        float,
        typer.Option(min=-10.0, max=10.0, help="simulated: cameras turned away from each other"),
    ] = 0.0,
    zero_mm: Annotated[
        float,
        typer.Option(
            min=-100.0, max=100.0, help="simulated: the tape begins in front of the cameras"
        ),
    ] = 0.0,
    noise_px: Annotated[
        float, typer.Option(min=0.0, max=10.0, help="simulated: sigma of a disparity")
    ] = 0.1,
    tape_mm: Annotated[
        float, typer.Option(min=0.0, max=50.0, help="simulated: sigma of placing the target")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="of the simulated noise")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Fit the depth law D = k x^z of the RHOT paper to a bench of measured distances."""
    from services.calibrator.depth_law import fit as laws

    if (table is None) == (not simulate):
        raise CalibrationError(
            f"give either a CSV with the columns {','.join(laws.CSV_HEADER)}, or --simulate for the seed's bench"
        )
    focal_px, baseline_cm, width_px = _geometry(config)
    if table is not None:
        distances, disparities = laws.read_bench(table)
    else:
        distances, disparities = laws.bench(
            focal_px=focal_px,
            baseline_cm=baseline_cm,
            divergence_rad=float(np.radians(divergence_deg)),
            zero_cm=0.1 * zero_mm,
            noise_px=noise_px,
            tape_cm=0.1 * tape_mm,
            seed=seed,
        )
    law = laws.fit_depth(distances, disparities, focal_px, baseline_cm, width_px)
    typer.echo(msgspec.json.encode(asdict(law)).decode() if as_json else laws.depth_text(law))


def _geometry(config: Path | None) -> tuple[float, float, int]:
    """Focal length px, baseline cm and picture width px of a rig's first two cameras, or of the
    seed's.
    """
    from services.calibrator.depth_law.fit import SEED_BASELINE_CM, SEED_FOCAL_PX, SEED_WIDTH_PX

    if config is None:
        return SEED_FOCAL_PX, SEED_BASELINE_CM, SEED_WIDTH_PX
    cameras = list(load_rig_cameras(load_rig(config)).values())
    if len(cameras) < 2:
        raise CalibrationError(f"{config}: a depth law needs two cameras; it has {len(cameras)}")
    first, second = cameras[:2]
    baseline_m = float(np.linalg.norm(second.centre_rig - first.centre_rig))
    return 0.25 * (sum(first.focal_px) + sum(second.focal_px)), 100.0 * baseline_m, first.size_px[0]
