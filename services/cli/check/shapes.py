"""Problems of the shapes of objects: mesh files that are missing, broken, or in another unit."""

from __future__ import annotations

from pathlib import Path

from rhot.errors import RhotError
from rhot.files.config import RigConfig
from rhot.files.shapes import solid_of
from rhot.files.table_rules import shape_problem
from services.cli.check.problems import Problem, error


def check_shapes(config: RigConfig) -> list[Problem]:
    """Each mesh is read as services read it; shapes that do not fit are rig.toml's own problem."""
    problems = []
    for table in config.object:
        if not table.mesh or shape_problem(table):
            continue
        where = Path(config.folder) / table.mesh
        try:
            solid_of(table, Path(config.folder))
        except RhotError as wrong:
            text = str(wrong).removeprefix(f"{where}: ")
            problems.append(error(where, f"mesh of object {table.name!r}: {text}"))
    return problems
