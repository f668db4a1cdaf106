"""How often, how long and with which fingers objects are held."""

import sys
from collections import Counter

import rhot


def main() -> None:
    counts: Counter[str] = Counter()
    begun_ns: dict[tuple[str, str], int] = {}
    with rhot.open(*sys.argv[1:2]) as rig:
        for event in rig.grasps():
            key = (event.object, event.hand)
            if event.kind == "begin":
                begun_ns[key] = event.stamp_ns
                counts[event.object] += 1
                fingers = ", ".join(event.parts)
                print(f"{event.object}: grasp {counts[event.object]} with {fingers}", flush=True)
            elif key in begun_ns:
                seconds = (event.stamp_ns - begun_ns.pop(key)) * 1e-9
                print(f"{event.object}: let go after {seconds:.1f} s", flush=True)
    print(dict(counts))


main()
