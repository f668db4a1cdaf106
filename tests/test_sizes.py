"""How large files, functions, folders and lines may become, and that nothing is written twice."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from statistics import median

from testing.source_tree import BESIDE, CODE, ROOT, keep_to, relative, tree_of

MAX_FILE_LINES, MAX_MEDIAN_LINES, MAX_FUNCTION_LINES, MAX_MAIN_LINES = 300, 120, 50, 40
MAX_LINE, MAX_FILES_IN_A_FOLDER = 100, 14

# Lines of code that may stand twice; more need one place, or a comment with this word beside them.
MAX_TWICE, REASON = 5, "# Alike in "


def functions_of(path: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def own_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    lines = (node.end_lineno or node.lineno) - node.lineno + 1
    if ast.get_docstring(node):
        lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
    return lines


def test_files_stay_small():
    def too_large(path: Path) -> Iterator[str]:
        lines = path.read_text(encoding="utf-8").count("\n")
        if lines > MAX_FILE_LINES:
            yield f" has outgrown its room: {lines} lines"

    keep_to(too_large, [*CODE, *BESIDE])


def test_functions_stay_small():
    def too_large(path: Path) -> Iterator[str]:
        for node in functions_of(path):
            limit = MAX_MAIN_LINES if node.name == "serve" else MAX_FUNCTION_LINES
            if own_lines(node) > limit:
                yield f":{node.lineno} {node.name} has {own_lines(node)} lines"

    keep_to(too_large)


def test_the_median_file_is_short():
    assert median(path.read_text().count("\n") for path in CODE) <= MAX_MEDIAN_LINES


def test_lines_are_short():
    def too_long(path: Path) -> Iterator[str]:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if len(line) > MAX_LINE:
                yield f":{number} has {len(line)} columns"

    keep_to(too_long, [*CODE, *BESIDE])


def test_lines_of_pages_are_short():
    """Rows of tables may be longer: Markdown has no other way."""
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]:
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            is_row = line.startswith("|") or line.endswith(("|", "\\"))
            assert len(line) <= MAX_LINE or is_row, f"{relative(path)}:{number}"


def test_folders_stay_small():
    for folder in {path.parent for path in CODE}:
        files = list(folder.glob("*.py"))
        assert len(files) <= MAX_FILES_IN_A_FOLDER or folder.name == "sources", (
            f"{relative(folder)} has {len(files)} files: give some of them a room"
        )


def code_lines(path: Path) -> list[tuple[int, str]]:
    """Numbered lines that say something: no imports, comments, docstrings or lone brackets."""
    silent: set[int] = set()
    for node in ast.walk(tree_of(path)):
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if is_text or isinstance(node, ast.Import | ast.ImportFrom):
            silent |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return [
        (number, text)
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if number not in silent and len(text := line.strip()) > 4 and not text.startswith("#")
    ]


def test_no_passage_stands_twice_without_a_reason():
    count = MAX_TWICE + 1
    places = defaultdict(list)
    for path in CODE:
        lines, text = code_lines(path), path.read_text().splitlines()
        for start in range(len(lines) - count + 1):
            passage = lines[start : start + count]
            first, last = passage[0][0], passage[-1][0]
            # A reason stands within the passage or in the six lines above it.
            if not any(REASON in line for line in text[max(0, first - 7) : last]):
                places[tuple(line for _, line in passage)].append(f"{relative(path)}:{first}")
    twice = [" ~ ".join(where) for where in places.values() if len(where) > 1]
    assert not twice, f"write it once, or say beside it why not ('{REASON}...'): {twice}"
