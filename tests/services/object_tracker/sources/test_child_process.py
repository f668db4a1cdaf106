"""Child processes that print what no program should: floods, garbage, endless lines."""

from __future__ import annotations

import asyncio
import contextlib

from services.object_tracker.sources.child_process import start


async def lines_of(script: str, count: int) -> tuple[list[str], int, list[str]]:
    """The first lines, how many were skipped as too long, and its last words."""
    child = await start(["sh", "-c", script], "")
    found: list[str] = []
    try:
        async with asyncio.timeout(60.0), contextlib.aclosing(child.lines(10.0)) as groups:
            async for lines in groups:
                found += lines
                if len(found) >= count:
                    break
    finally:
        await child.stop()
    return found, child.skipped, list(child.last_words)


async def test_lines_whole_and_in_pieces() -> None:
    found, skipped, _ = await lines_of("echo one; printf tw; sleep 0.3; echo o; printf three", 9)
    assert (found, skipped) == (["one", "two", "three"], 0)


async def test_lines_too_long_are_skipped_whole() -> None:
    """Megabytes without an end, and what then looks like a line: all of it is left out."""
    script = (
        "echo a; head -c 1000000 /dev/zero; echo x; echo b; head -c 9000000 /dev/zero; echo; echo c"
    )
    found, skipped, _ = await lines_of(script, 9)
    assert (found, skipped) == (["a", "b", "c"], 2)


async def test_a_flood_leaves_the_loop_its_turns() -> None:
    """100 MB/s of lines on both outputs; another task runs all the same."""
    child = await start(["sh", "-c", "yes >&2 & exec yes"], "")
    turns = 0

    async def others() -> None:
        nonlocal turns
        # The child needs a while to begin.
        while turns < 20 or not child.last_words:
            turns += 1
            await asyncio.sleep(0.001)

    async def flood() -> None:
        async with contextlib.aclosing(child.lines(10.0)) as groups:
            async for _ in groups:
                pass

    reader = asyncio.create_task(flood())
    try:
        async with asyncio.timeout(60.0):
            await others()
    finally:
        reader.cancel()
        await asyncio.gather(reader, return_exceptions=True)
        assert await child.stop() == "was ended by SIGTERM"
    assert turns >= 20
    assert set(child.last_words) == {"y"}


async def test_last_words_are_few_short_and_plain() -> None:
    script = r"""for i in 1 2 3 4 5; do echo $i >&2; done
printf '\033[31mred\033[0m\007 text\n' >&2; head -c 100000 /dev/urandom | tr -d '\n' >&2"""
    _, _, words = await lines_of(script, 1)
    assert words[:2] == ["5", "red  text"]
    assert len(words) == 3
    assert all(len(word) <= 200 and word.isprintable() for word in words)
