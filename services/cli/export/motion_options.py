"""The options of `rhot export` that are about motion for other programs."""

from __future__ import annotations

from typing import Annotated

import typer

BvhOption = Annotated[bool, typer.Option("--bvh", help="each hand's motion for Blender, Unity")]
TrcOption = Annotated[bool, typer.Option("--trc", help="joints as markers, for OpenSim")]
MotOption = Annotated[bool, typer.Option("--mot", help="joint angles, for OpenSim")]
GltfOption = Annotated[bool, typer.Option("--gltf", help="a skinned hand that moves, as .glb")]
UpOption = Annotated[
    str,
    typer.Option(
        metavar="AXIS",
        help="which way of the rig's frame is up, for --bvh, --trc, --mot, --gltf: "
        "-y of an upright camera, or e.g. z of a rig with [rig.world]",
    ),
]
