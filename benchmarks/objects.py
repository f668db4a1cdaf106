"""Everything about objects: `python benchmarks/objects.py [--only PART ...] [--json FILE]`

The parts, each a file of its own beside this one: registration of the lighthouses to the rig, the
same from rendered pictures, tracking (load, filter, outliers, drift), contacts and grasps.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from pathlib import Path
from typing import Any

PARTS = {
    "registration": "objects_registration",
    "pictures": "objects_pictures",
    "tracking": "objects_tracking",
    "grasps": "objects_grasps",
    "grasp_pictures": "objects_grasp_pictures",
}


def main() -> int:
    """Run the parts, print, and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="these parts")
    options = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parent))
    figures: dict[str, Any] = {}
    for part in options.only:
        print(f"\n{part}")
        figures |= importlib.import_module(PARTS[part]).measure()
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
