"""The public names of the package `rhot`, a line each: `python -m testing.public_names --write`.

They are what other programs build on, so they change only on purpose: tests/public_names.txt is
their list, and tests/test_public_names.py compares it with the code.
"""

from __future__ import annotations

import ast
import sys

from testing.source_tree import CODE, ROOT, relative, tree_of

LIST = ROOT / "tests" / "public_names.txt"


def public_names() -> list[str]:
    """`module: name` of every class, function and constant, `module: Class.method` of methods."""
    names = []
    for path in CODE:
        parts = path.relative_to(ROOT).with_suffix("").parts
        if parts[0] != "rhot" or any(part.startswith("_") for part in parts[:-1]):
            continue
        module = ".".join(part for part in parts if part != "__init__")
        names += [f"{module}: {name}" for name in sorted(_names_of(tree_of(path)))]
    return names


def _names_of(tree: ast.Module) -> set[str]:
    names: set[str] = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.ClassDef):
            names |= {node.name} | {f"{node.name}.{name}" for name in _members_of(node)}
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names |= {one.id for one in targets if isinstance(one, ast.Name)}
            if any(isinstance(one, ast.Name) and one.id == "__all__" for one in targets):
                names |= set(ast.literal_eval(node.value))  # type: ignore[arg-type]
    return {name for name in names if not any(part.startswith("_") for part in name.split("."))}


def _members_of(node: ast.ClassDef) -> set[str]:
    """Methods and fields of a class."""
    members = {
        one.name for one in node.body if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    return members | {
        one.target.id
        for one in node.body
        if isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Name)
    }


if __name__ == "__main__":
    text = "\n".join(public_names()) + "\n"
    if "--write" in sys.argv:
        LIST.write_text(text)
        print(f"{relative(LIST)}: {text.count(chr(10))} names")
    else:
        print(text, end="")
