"""With asyncio, several streams at once: poses are counted while services come and go."""

import asyncio
import sys

import rhot


async def services(rig: rhot.RigClient) -> None:
    async for service in rig.services():
        state = "is there" if service.alive else "is gone"
        print(f"{service.service} {service.instance} {state}", flush=True)


async def poses(rig: rhot.RigClient) -> None:
    for_hand = {"left": 0, "right": 0}
    async for pose in rig.hand_poses(queue=64):
        for_hand[pose.hand] += 1
        if sum(for_hand.values()) % 30 == 0:
            print(for_hand, flush=True)


async def main() -> None:
    async with rhot.connect(*sys.argv[1:2]) as rig, asyncio.TaskGroup() as tasks:
        tasks.create_task(services(rig))
        tasks.create_task(poses(rig))


rhot.run(main())
