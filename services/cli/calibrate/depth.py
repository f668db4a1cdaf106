"""`rhot calibrate depth bench.csv`: k, z and phi of the RHOT paper's depth law.

From measured distances, or from the paper's bench, simulated.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np
import typer

from rhot.errors import CalibrationError
from rhot.files.calibration import load_rig_cameras
from rhot.files.config import load_rig
from rhot.geometry.transforms import Array
from services.cli.calibrate.options import JsonOption
from services.cli.option_groups import grouped

if TYPE_CHECKING:
    from services.calibrator.depth_law.fit import StereoPair

CsvArgument = Annotated[
    Path | None, typer.Argument(metavar="CSV", help="columns distance_cm,disparity_px")
]
RigOption = Annotated[
    Path | None,
    typer.Option("--config", help="rig.toml, for focal length and baseline; default: the paper's"),
]


@dataclass(frozen=True)
class SimulationOptions:
    """The paper's bench, simulated, and what is imperfect about it."""

    simulate: Annotated[
        bool, typer.Option("--simulate", help="the paper's bench, simulated, instead of a CSV")
    ] = False
    divergence_deg: Annotated[
        float,
        typer.Option(min=-10.0, max=10.0, help="simulated: cameras turned away from each other"),
    ] = 0.0
    zero_mm: Annotated[
        float,
        typer.Option(
            min=-100.0, max=100.0, help="simulated: the tape begins in front of the cameras"
        ),
    ] = 0.0
    noise_px: Annotated[
        float, typer.Option(min=0.0, max=10.0, help="simulated: sigma of a disparity")
    ] = 0.1
    tape_mm: Annotated[
        float, typer.Option(min=0.0, max=50.0, help="simulated: sigma of placing the target")
    ] = 1.0
    seed: Annotated[int, typer.Option(min=0, help="random seed of the simulated noise")] = 1

    def measure(self, pair: StereoPair) -> tuple[Array, Array]:
        """Distances cm and disparities px of the simulated bench with a pair of cameras."""
        from services.calibrator.depth_law.bench import BenchErrors, simulate_bench

        errors = BenchErrors(
            divergence_rad=float(np.radians(self.divergence_deg)),
            zero_cm=0.1 * self.zero_mm,
            noise_px=self.noise_px,
            tape_cm=0.1 * self.tape_mm,
        )
        return simulate_bench(errors, pair=pair, random_seed=self.seed)


@grouped
def depth(
    table: CsvArgument = None,
    config: RigOption = None,
    *,
    simulation: SimulationOptions,
    as_json: JsonOption = False,
) -> None:
    """Fit the depth law D = k x^z of the RHOT paper to a bench of measured distances."""
    from services.calibrator.depth_law.bench import CSV_HEADER, read_bench
    from services.calibrator.depth_law.fit import fit_depth
    from services.calibrator.depth_law.report import depth_text

    if (table is None) == (not simulation.simulate):
        raise CalibrationError(
            f"give either a CSV with the columns {','.join(CSV_HEADER)}, or --simulate for the "
            "paper's bench"
        )
    pair = _stereo_pair(config)
    distances, disparities = simulation.measure(pair) if table is None else read_bench(table)
    law = fit_depth(distances, disparities, pair)
    typer.echo(msgspec.json.encode(asdict(law)).decode() if as_json else depth_text(law))


def _stereo_pair(config: Path | None) -> StereoPair:
    """A rig's first two cameras, or the paper's."""
    from services.calibrator.depth_law.fit import PAPER_PAIR, StereoPair

    if config is None:
        return PAPER_PAIR
    cameras = list(load_rig_cameras(load_rig(config)).values())
    if len(cameras) < 2:
        raise CalibrationError(f"{config}: a depth law needs two cameras; it has {len(cameras)}")
    first, second = cameras[:2]
    baseline_m = float(np.linalg.norm(second.centre_rig - first.centre_rig))
    return StereoPair(
        focal_px=0.25 * (sum(first.focal_px) + sum(second.focal_px)),
        baseline_cm=100.0 * baseline_m,
        width_px=first.size_px[0],
    )
