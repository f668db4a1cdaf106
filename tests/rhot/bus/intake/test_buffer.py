"""What waits in a buffer is bounded in number, in keys and in bytes."""

from __future__ import annotations

import asyncio

import pytest

from rhot.bus.intake.buffer import MAX_BYTES, Buffer


async def test_a_queue_keeps_the_newest():
    buffer: Buffer[int] = Buffer(asyncio.get_running_loop(), 3)
    assert [buffer.push("k", n) for n in range(5)] == [0, 0, 0, 1, 1]
    assert [await buffer.take() for _ in range(3)] == [2, 3, 4]


async def test_a_hundred_thousand_keys_wait_as_a_few():
    buffer: Buffer[int] = Buffer(asyncio.get_running_loop(), None)
    assert buffer.push("first", -1) == 0
    dropped = sum(buffer.push(f"key {n}", n) for n in range(100_000))
    assert dropped == 100_000 - 255
    # A key that waits is renewed, however many strangers come.
    assert buffer.push("first", -2) == 1
    assert await buffer.take() == -2
    assert [await buffer.take() for _ in range(255)] == list(range(255))


async def test_large_items_are_bounded_by_their_bytes():
    loop = asyncio.get_running_loop()
    queue: Buffer[bytes] = Buffer(loop, 1000, len)
    newest: Buffer[bytes] = Buffer(loop, None, len)
    item = bytes(MAX_BYTES // 4)
    assert sum(queue.push("k", item) for _ in range(100)) == 96
    assert sum(newest.push(f"k{n}", item) for n in range(100)) == 96
    assert queue.waiting_bytes == newest.waiting_bytes == MAX_BYTES
    for _ in range(4):
        await queue.take()
        await newest.take()
    assert queue.waiting_bytes == newest.waiting_bytes == 0


async def test_one_item_may_be_larger_than_all():
    buffer: Buffer[bytes] = Buffer(asyncio.get_running_loop(), 2, len)
    assert buffer.push("k", bytes(2 * MAX_BYTES)) == 0
    assert buffer.push("k", bytes(3 * MAX_BYTES)) == 1
    assert len(await buffer.take()) == 3 * MAX_BYTES


async def test_a_renewed_key_counts_its_new_size():
    buffer: Buffer[bytes] = Buffer(asyncio.get_running_loop(), None, len)
    for size in (10, 1000, 20):
        buffer.push("k", bytes(size))
    assert buffer.waiting_bytes == 20
    await buffer.take()
    assert buffer.waiting_bytes == 0


async def test_each_item_is_given_to_a_function_in_order_until_the_end():
    buffer: Buffer[int] = Buffer(asyncio.get_running_loop(), 100)
    taken: list[int] = []
    buffer.push("k", 0)  # came before anybody asked
    consuming = asyncio.create_task(buffer.each(taken.append))
    await asyncio.sleep(0)
    assert taken == [0]
    for n in range(1, 100):
        buffer.push("k", n)
    while len(taken) < 100:
        await asyncio.sleep(0)
    assert taken == list(range(100))
    buffer.undeclare()
    await consuming


async def test_what_a_function_raises_ends_the_wait_and_leaves_the_rest():
    buffer: Buffer[int] = Buffer(asyncio.get_running_loop(), 10)
    for n in (1, 0, 2):
        buffer.push("k", n)
    with pytest.raises(ZeroDivisionError):
        await buffer.each(lambda n: 1 // n)
    assert await buffer.take() == 2
