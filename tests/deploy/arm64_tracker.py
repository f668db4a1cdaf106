"""Inside the emulated Debian of arm64.sh: the installed tracker finds the paint in pictures.

Uses the installed rhot, and testing/ for pictures whose truth is known.
"""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path

import cv2
import zenoh

from rhot import topics
from rhot.bus.bus import open_bus, router_config
from rhot.files.calibration import save
from rhot.messages import Session
from testing.synthetic_images import PAINTS, ROW_X_PX, Tip, clean, noisy, ranges

ENDPOINT = "tcp/127.0.0.1:17447"
FRAMES = 20
SIZE = (240, 120)
# Emulated, a first frame may take seconds.
DEADLINE_S = 120.0

RIG = f"""
[bus]
connect = ["{ENDPOINT}"]
[[camera]]
name = "left"
source = "folder:pictures"
size_px = [{SIZE[0]}, {SIZE[1]}]
[hand.right.markers]
wrist = "violet"
thumb_tip = "magenta"
index_tip = "blue"
middle_tip = "cyan"
ring_tip = "green"
little_tip = "lime"
"""


def write_rig(folder: Path) -> None:
    """rig.toml, colours, and pictures of six tips that move a little from one to the next."""
    (folder / "pictures").mkdir(parents=True)
    (folder / "rig.toml").write_text(RIG)
    save(folder / "calibration" / "left.colors.json", ranges())
    for number in range(FRAMES):
        tips = [Tip(color, x_px, 60.0 + 0.5 * number) for color, x_px in ROW_X_PX.items()]
        image, _ = clean(tips, SIZE)
        cv2.imwrite(str(folder / "pictures" / f"{number:03}.png"), noisy(image, 3.0, number))


async def seen(folder: Path) -> list[int]:
    """Markers of each frame that the installed tracker publishes."""
    command = ["/opt/rhot/current/bin/rhot-pi-tracker", "--config", str(folder / "rig.toml")]
    session = Session(running=True, start_ns=time.time_ns())
    counts: list[int] = []
    async with open_bus("desk", [ENDPOINT]) as bus:
        frames = bus.every(topics.MARKERS, FRAMES, camera="left")
        start = bus.publisher(topics.SESSION)
        tracker = await asyncio.create_subprocess_exec(*command, "--camera", "left")
        async with asyncio.timeout(DEADLINE_S):
            while tracker.returncode is None:
                start.put(session)
                await asyncio.sleep(0.5)
        assert tracker.returncode == 0, f"the tracker ended with code {tracker.returncode}"
        async with asyncio.timeout(5.0):
            async for frame in frames:
                counts.append(len(frame.markers))
                if len(counts) == FRAMES:
                    break
    return counts


def main() -> None:
    """Exit code 0 if every frame showed every paint."""
    folder = Path("/srv/proof/rig")
    write_rig(folder)
    router = zenoh.open(router_config([ENDPOINT]))
    counts = asyncio.run(seen(folder))
    router.close()
    print(f"{len(counts)} frames, markers in each: {sorted(set(counts))}")
    sys.exit(counts != [len(PAINTS)] * FRAMES)


if __name__ == "__main__":
    main()
