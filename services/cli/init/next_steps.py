"""What comes after `rhot init`, as commands for this very rig. Pure."""

from __future__ import annotations

from pathlib import Path

from services.cli.init.choices import Choices


def next_steps(path: Path, choices: Choices) -> str:
    """Numbered commands with what each is for."""
    steps: list[tuple[str, str]] = []
    if choices.hosts:
        steps.append((f"rhot pki init --config {path}", "certificates for every machine"))
        folder = path.parent
        copy = f"cp -r {folder / 'pki-hosts' / 'master'} {folder / 'pki'}"
        steps.append((copy, "this machine's, if it is the master"))
        steps += [(f"rhot deploy {host} --config {path}", "install it") for host in choices.hosts]
    steps += [
        (f"rhot check {path}", "what is wrong or missing, with the command that mends it"),
        (f"rhot up {path}", "run the rig, and see its cameras in a browser"),
    ]
    names = [camera.name for camera in choices.cameras]
    steps += [
        (f"rhot calibrate camera {name} --auto --config {path}", "its exposure") for name in names
    ]
    if len(choices.cameras) > 1 and choices.markers:
        board = f"rhot calibrate stereo pictures --live --config {path}"
        steps += [("rhot board", "a chessboard to print"), (board, "lenses and places of cameras")]
    steps += [(f"rhot calibrate colors {name} --config {path}", "its colours") for name in names]
    steps += [
        (f"rhot calibrate hand {hand} --config {path}", "its bones") for hand in choices.markers
    ]
    if choices.objects:
        objects = f"rhot calibrate objects --config {path}"
        steps.append((objects, "where the lighthouses are, from paint on a tracker"))
    width = max(len(command) for command, _ in steps)
    lines = [f"  {command.ljust(width)}   # {what}" for command, what in steps]
    return "\n".join([*lines, "\nStep by step: docs/guide/first-rig.md"])
