"""The folder of compiled kernels: one for each state of the sources, and never one of an older
state.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from rhot.kernels.numba_cache import adopt, cache_folder, clear_old, use_cache

PACKAGE = (
    "from pathlib import Path\n\nfrom rhot.kernels.numba_cache import use_cache\n\n"
    "use_cache(Path(__file__).parent)\n"
)
# numba counts what it read from its cache, for `outer` itself.
HITS = "from kernels.outer import outer; outer(1); print(sum(outer.stats.cache_hits.values()))"
KERNEL = "from numba import njit\n\n\n@njit(cache=True)\ndef {name}(x):\n    return {body}\n"


@pytest.fixture
def package(tmp_path, monkeypatch):
    monkeypatch.setenv("RHOT_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delitem(sys.modules, "numba", raising=False)
    folder = tmp_path / "kernels"
    folder.mkdir()
    (folder / "__init__.py").write_text(
        "from pathlib import Path\n\nfrom rhot.kernels.numba_cache import use_cache\n\n"
        "use_cache(Path(__file__).parent)\n"
    )
    (folder / "inner.py").write_text(KERNEL.format(name="inner", body="x + 1"))
    outer = KERNEL.format(name="outer", body="inner(x)").replace(
        "import njit\n", "import njit\n\nfrom kernels.inner import inner\n"
    )
    (folder / "outer.py").write_text(outer)
    (folder / "plain.py").write_text("ANSWER = 42\n")
    return folder


def subfolder(package) -> str:
    """Where numba keeps the kernels of a folder's files."""
    return f"{package.name}_{hashlib.sha1(str(package).encode()).hexdigest()}"


def outcome(package, code="from kernels.outer import outer; print(outer(1))", **variables) -> int:
    environment = {**os.environ, "PYTHONPATH": str(package.parent), **variables}
    return int(
        subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )


def test_a_changed_callee_is_compiled_anew(package):
    assert outcome(package) == 2
    before = cache_folder(package)
    assert list(before.rglob("*.nbc"))
    (package / "inner.py").write_text(KERNEL.format(name="inner", body="x + 10"))
    # Also below a parent process that still has the old folder in its environment.
    assert outcome(package, NUMBA_CACHE_DIR=str(before)) == 11
    clear_old(package)
    assert not before.exists()
    assert cache_folder(package).is_dir()


def test_files_without_kernels_do_not_count(package):
    before = cache_folder(package)
    (package / "plain.py").write_text("ANSWER = 43\n")
    assert cache_folder(package) == before


def test_a_users_own_choice_stays(package, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "mine"))
    assert use_cache(package) is None
    assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path / "mine")


def test_without_a_folder_to_write_numba_decides(package, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("RHOT_CACHE", str(tmp_path / "file"))
    assert use_cache(package) is None
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_systemds_folder_comes_before_the_users(package, monkeypatch, tmp_path):
    monkeypatch.delenv("RHOT_CACHE")
    monkeypatch.setenv("CACHE_DIRECTORY", f"{tmp_path / 'rhot'}:{tmp_path / 'other'}")
    assert cache_folder(package).parent == tmp_path / "rhot"


def test_kernels_of_another_version_are_taken_over(package, tmp_path):
    """As after an upgrade that changes no kernel: nothing is compiled."""
    assert outcome(package) == 2
    new = tmp_path / "new" / "kernels"
    shutil.copytree(package, new, ignore=shutil.ignore_patterns("__pycache__"))
    assert adopt(new) == cache_folder(package)
    assert sorted(path.name for path in cache_folder(new).iterdir()) == [subfolder(new)]
    assert outcome(new, code=HITS) == 1
    assert adopt(new) is None


def test_who_starts_without_its_own_kernels_takes_over_those_of_another_place(package, tmp_path):
    """As a service of an installation in which nobody ran `rhot warm`; two start at once."""
    assert outcome(package) == 2
    new = tmp_path / "new" / "kernels"
    shutil.copytree(package, new, ignore=shutil.ignore_patterns("__pycache__"))
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(lambda _: outcome(new, code=HITS), range(2))) == [1, 1]
    assert (cache_folder(new) / "place.txt").read_text() == str(new)


def test_other_kernels_are_not_taken_over(package, tmp_path):
    assert outcome(package) == 2
    new = tmp_path / "new" / "kernels"
    shutil.copytree(package, new, ignore=shutil.ignore_patterns("__pycache__"))
    (new / "inner.py").write_text(KERNEL.format(name="inner", body="x + 10"))
    assert adopt(new) is None


def test_kernels_of_what_is_gone_go_and_those_of_another_place_stay(package, tmp_path):
    assert outcome(package) == 2
    for name in ("gone", "other"):
        shutil.copytree(package, tmp_path / name / "kernels")
        assert outcome(tmp_path / name / "kernels") == 2
    shutil.rmtree(tmp_path / "gone")
    clear_old(package)
    left = {cache_folder(package), cache_folder(tmp_path / "other" / "kernels")}
    assert set((tmp_path / "cache").iterdir()) == left
