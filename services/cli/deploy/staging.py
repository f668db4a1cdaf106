"""The folder that `rhot deploy` brings to a machine: install.sh with its units, wheels, rig.toml,
calibrations, and the machine's certificate.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from rhot.bus.security.credentials import CA, CERTIFICATE, KEY
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from services.cli.deploy.plan import Machine, calibrations

# Where `rhot pki` keeps the certificates of all hosts, beside rig.toml.
PKI_HOSTS = "pki-hosts"


def deploy_dir() -> Path:
    """The folder of install.sh: deploy/ of the source tree, or the wheel's copy of it.

    Raises ConfigError where the installation is incomplete.
    """
    here = Path(__file__).parent
    for folder in (here / "files", here.parents[2] / "deploy"):
        if (folder / "install.sh").is_file():
            return folder
    raise ConfigError(f"{here / 'files'}: install.sh is missing; install rhot again")


def source_tree() -> Path | None:
    """The source tree that this rhot runs from; None where it was installed from a wheel."""
    tree = deploy_dir().parent
    return tree if (tree / "pyproject.toml").is_file() else None


def wheels_for(of: Machine, wheels: Path) -> list[Path]:
    """The wheels of a folder; of its subfolder named after the role, where it has one.

    Raises ConfigError if there is none of rhot.
    """
    folder = wheels / of.role if (wheels / of.role).is_dir() else wheels
    found = sorted(folder.glob("*.whl"))
    if not any(path.name.startswith("rhot-") for path in found):
        raise ConfigError(f"{folder} holds no wheel of rhot; `make wheels` collects all of them")
    return found


def certificate_files(of: Machine, config: RigConfig) -> list[Path]:
    """ca.pem, own.pem and own.key of the machine; none without TLS.

    Raises ConfigError if they have not been made.
    """
    if not of.certificate:
        return []
    folder = Path(config.folder) / PKI_HOSTS / of.certificate
    files = [folder / name for name in (CA, CERTIFICATE, KEY)]
    if missing := [path.name for path in files if not path.is_file()]:
        raise ConfigError(
            f"{folder}: {', '.join(missing)} missing; rig.toml's [bus] has a tls endpoint, so the "
            "machine needs a certificate: `rhot pki init` makes those of the whole rig"
        )
    return files


def stage(of: Machine, config: RigConfig, rig_toml: Path, wheels: list[Path], folder: Path) -> None:
    """Fill the folder; without wheels, rhot's own is built from the source tree.

    That one has the tracker's compiled form for a Pi if this machine has a compiler for it.

    Raises ConfigError if that cannot be done.
    """
    shutil.copytree(deploy_dir(), folder / "deploy")
    shutil.copy(rig_toml, folder / "rig.toml")
    for name, files in (
        ("calibration", calibrations(config, of)),
        ("pki", certificate_files(of, config)),
        ("wheels", wheels),
    ):
        (folder / name).mkdir(mode=0o700)
        for path in files:
            shutil.copy(path, folder / name)
    if not wheels:
        _build_wheel(folder / "wheels")


def _build_wheel(folder: Path) -> None:
    tree = source_tree()
    if tree is None:
        raise ConfigError(
            "this rhot was not installed from its source tree, so it has no wheel to bring along: "
            "name a folder that has it with --wheels"
        )
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check"]
    # Which machine it is for is not known here: a wheel for each that there are packages for.
    environment = os.environ | {"RHOT_COMPILE_FOR": "x86_64 aarch64"}
    done = subprocess.run(
        [*command, "--no-deps", "-w", str(folder), str(tree)], check=False, env=environment
    )
    if done.returncode:
        raise ConfigError("rhot's wheel could not be built (see above)")
