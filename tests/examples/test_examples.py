"""Every program of examples/: run as a user runs it, on a real router, until Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
import sys
from pathlib import Path

import pytest

from testing.hand_stream import stream_hand

EXAMPLES = Path(__file__).parents[2] / "examples"
# What each prints when it works, and what it leaves behind.
PRINTS = {
    "pinch_click": (r"down at .*\nup", None),
    # Who begins to look while fingers are pinched sees only the end of that stroke.
    "draw_in_air": (r"stroke \d: \d\d+ points", "drawing.svg"),
    "log_csv": (r"1\.\d s", "hand.csv"),
    "robot_gripper": (r"open 0\.[01]\d(?s:.*)open 0\.[89]", None),
    "grasp_counter": (r"cup: grasp 2 with thumb, index", None),
    "plot_live": (r"[1-9]\d poses", None),
    "range_of_motion": (r"bend and stretch", None),
    "hand_to_udp": (r"31 poses sent", None),
    "cup_in_hand": (r"right 20, up 0, back -100 mm", None),
    "two_streams": (r"solver main is there(?s:.*)'right': 30", None),
}
DEADLINE_S = 60.0


def test_there_are_no_others():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(PRINTS)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_it_is_short_and_says_what_it_does(path):
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= 30
    assert text.startswith('"""')


@pytest.mark.integration
async def test_all_work_and_end_quietly(router, tmp_path):
    stream = asyncio.create_task(stream_hand(router, 2 * DEADLINE_S))
    async with asyncio.TaskGroup() as tasks:
        runs = {
            name: tasks.create_task(_run(name, router, tmp_path, prints))
            for name, (prints, _) in PRINTS.items()
        }
    stream.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await stream
    for name, run in runs.items():
        code, errors = run.result()
        assert (code, errors) == (0, ""), name
    for _, left in PRINTS.values():
        assert left is None or (tmp_path / left).stat().st_size > 200


async def _run(name: str, router: str, folder: Path, prints: str) -> tuple[int, str]:
    """Exit code and what stands on stderr, ended by Ctrl-C once it has printed what it should."""
    environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONPATH": str(EXAMPLES.parent)}
    extra = [] if name != "hand_to_udp" else ["9"]
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        str(EXAMPLES / f"{name}.py"),
        router,
        *extra,
        cwd=folder,
        env=environment,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    said = ""
    try:
        async with asyncio.timeout(DEADLINE_S):
            while not re.search(prints, said):
                read = await process.stdout.read(4096)
                assert read, f"{name} ended: {said}{(await process.stderr.read()).decode()}"
                said += read.decode()
        process.send_signal(signal.SIGINT)
        async with asyncio.timeout(DEADLINE_S):
            _, errors = await process.communicate()
    except TimeoutError:
        process.kill()
        raise AssertionError(f"{name} has not said {prints!r} but: {said[-500:]}") from None
    finally:
        if process.returncode is None:
            process.kill()
    return process.returncode or 0, errors.decode()
