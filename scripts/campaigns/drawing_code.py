"""Digests of the code that draws pictures, by which tests find pictures that are older."""

from __future__ import annotations

import ast
import functools
import hashlib
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "petcontact"
FIGURES = PACKAGE / "results" / "figures"


def files(*names: str) -> tuple[Path, ...]:
    """Modules of `results.figures` by name, and the style that all have in common."""
    return *(FIGURES / f"{name}.py" for name in names), PACKAGE / "runtime" / "figure_style.py"


@functools.cache
def digest_of_code(paths: tuple[Path, ...]) -> str:
    """Of modules without their comments and docstrings."""
    trees = []
    for path in paths:
        tree = ast.parse(path.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                node.value = ast.Constant(None)
        trees.append(ast.dump(tree))
    return digest_of_text("\n".join(trees))


def digest_of_text(text: str) -> str:
    """Of anything in words."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]
