"""`rhot warm`: what is wrong with a file is told as if one process had read it."""

from __future__ import annotations

import shutil

import pytest

from rhot.errors import CalibrationError
from services.cli.live.warm import warm


def test_says_what_it_compiles_and_names_a_broken_calibration(tmp_path, repository, capsys):
    config = tmp_path / "config"
    shutil.copytree(repository / "config", config)
    rig = config / "sim.toml"
    # Without pictures to render: those need no hand's calibration.
    rig.write_text(rig.read_text().replace('source = "simulator"', 'source = "picamera"'))
    (config / "calibration" / "hand.right.json").write_text('{"x":')
    with pytest.raises(CalibrationError, match=r"hand\.right\.json.*rhot calibrate hand"):
        warm(rig)
    assert "the kernels of solver, fusion into" in capsys.readouterr().out
