"""`rhot grasp`: each command is one function in the file of its name."""

from __future__ import annotations

from services.cli.grasp.compare import compare
from services.cli.grasp.measuring.measure import measure
from services.cli.grasp.recover import recover
from services.cli.grasp.rectify import rectify
from services.cli.grasp.render import render
from services.cli.grasp.report import report
from services.cli.options import menu

grasp = menu("grasp", "A filmed finger's joint angles, and the same from its tip's path alone.")

for command in (render, measure, rectify, recover, report, compare):
    grasp.command(name=command.__name__)(command)
