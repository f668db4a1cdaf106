"""Several computers on one: network namespaces joined by a switch, and real systemd in each.

Needs root, systemd-nspawn and iproute2; `missing()` says what is not there.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

# Program -> Debian package that holds it.
_PROGRAMS = {
    "ip": "iproute2",
    "systemd-nspawn": "systemd-container",
    "systemctl": "systemd",
    "nsenter": "util-linux",
    "setpriv": "util-linux",
}


def missing() -> str:
    """Why no hosts can be made here, with the remedy; empty if they can."""
    if os.geteuid() != 0:
        return "needs root (namespaces, overlay): sudo make test-system"
    absent = sorted({package for name, package in _PROGRAMS.items() if not shutil.which(name)})
    if absent:
        return f"needs Debian packages: sudo apt install {' '.join(absent)}"
    if not Path("/usr/bin/python3").exists():
        return "needs the system's Python, which units run: sudo apt install python3-venv"
    probe = subprocess.run(
        ["unshare", "--mount", "--net", "--pid", "--fork", "true"], capture_output=True, check=False
    )
    if probe.returncode:
        said = probe.stderr.decode(errors="replace").strip()
        return f"needs a machine where root may make namespaces, not a locked container: {said}"
    return ""
