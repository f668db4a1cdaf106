"""Which failed imports are the user's to mend, and with which command."""

from __future__ import annotations

import pytest

from rhot.process.extras import missing_extra


@pytest.mark.parametrize(
    ("module", "program", "extra"),
    [
        ("scipy.optimize", "rhot-fusion", "master"),
        ("cv2", "rhot-pi-tracker", "pi"),
        ("cv2", "rhot", "master"),
        ("matplotlib.figure", "rhot", "study"),
        ("openvr", "rhot-object-tracker", "openvr"),
    ],
)
def test_the_extra_is_that_of_module_and_program(module, program, extra):
    error = missing_extra(ModuleNotFoundError("no", name=module), program)
    assert f"`pip install 'rhot[{extra}]'`" in str(error)
    assert str(error).startswith(f"needs {module.partition('.')[0]}, which is not installed")


@pytest.mark.parametrize(
    "error",
    [
        ModuleNotFoundError("no", name="rhot.nothing"),
        ModuleNotFoundError("no name"),
        ImportError("numba is broken", name="numba"),
        ValueError("numba"),
    ],
)
def test_everything_else_is_no_missing_extra(error):
    assert missing_extra(error, "rhot") is None
