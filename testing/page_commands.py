"""The commands of docs/guide/operations.md, each with the lines that it should print."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import signal
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(r"^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)
_SETUP = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Command:
    """One command line, and what its output has: lines in which `...` stands for anything."""

    section: str
    line: str
    expected: tuple[str, ...]

    def missing(self, output: str) -> list[str]:
        """The expected lines that are not in the output."""
        return [line for line in self.expected if not pattern(line).search(output)]


def pattern(line: str) -> re.Pattern[str]:
    """A line of the page as an expression: `...` is anything, and so is the width of a gap."""
    body = ".*".join(r"\s+".join(map(re.escape, part.split())) for part in line.split("..."))
    return re.compile(rf"^\s*{body}\s*$", re.MULTILINE)


def commands(page: str) -> list[Command]:
    """All commands of a page, in order; a line that ends in a backslash goes on in the next."""
    found: list[Command] = []
    for block in _BLOCK.finditer(page):
        section = re.findall(r"^#+ (.*)$", page[: block.start()], re.MULTILINE)[-1]
        for text in re.split(r"^\$ ", block[1], flags=re.MULTILINE)[1:]:
            line, _, output = text.replace("\\\n", "").partition("\n")
            expected = tuple(one for one in output.splitlines() if one.strip(" ."))
            found.append(Command(section, line, expected))
    return found


def setup(page: str) -> str:
    """What the page has a reader type once, in ```sh blocks."""
    return "\n".join(block[1] for block in _SETUP.finditer(page))


async def run(
    line: str, before: str, folder: Path, enough: Command, deadline_s: float
) -> tuple[int, str]:
    """Exit code and output of a command line in a shell, in `folder`.

    One that goes on for ever is interrupted, as by Ctrl-C, once it has printed what it should.
    """
    process = await asyncio.create_subprocess_exec(
        "bash",
        "-c",
        f"{before}\n{line}",
        cwd=folder,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        start_new_session=True,
        # Who runs tests in the background has interrupts ignored, and hands that on.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        limit=1 << 24,
    )
    assert process.stdout is not None
    output = ""
    try:
        async with asyncio.timeout(deadline_s):
            while chunk := await process.stdout.read(1 << 16):
                output += chunk.decode(errors="replace")
                if enough.expected and not enough.missing(output):
                    # It may be at its end; if not, it would never be.
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(1.0):
                            output += (await process.stdout.read()).decode(errors="replace")
                    break
    except TimeoutError:
        output += f"\n[still running after {deadline_s:g} s]"
    return await _ended(process), output


async def _ended(process: asyncio.subprocess.Process) -> int:
    """Interrupt a shell that has not ended; its exit code, or that of the command that it ran.

    Again after a second, as a person would: bash ignores an interrupt that meets a command of a
    loop at its very end.
    """
    for _ in range(10):
        with contextlib.suppress(ProcessLookupError):
            if process.returncode is None:
                os.killpg(process.pid, signal.SIGINT)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(1.0):
                code = await process.wait()
                return 0 if code in (-signal.SIGINT, 128 + signal.SIGINT) else code
    os.killpg(process.pid, signal.SIGKILL)
    await process.wait()
    return 1
