"""Sizes of files and functions that no formatter changes: statements, branches, local names."""

from __future__ import annotations

import ast
import json
from pathlib import Path

from import_graph import tree_of

BRANCHES = (
    ast.If,
    ast.IfExp,
    ast.For,
    ast.While,
    ast.comprehension,
    ast.ExceptHandler,
    ast.BoolOp,
    ast.match_case,
)
LISTED = json.loads((Path(__file__).parent / "data" / "larger_than_allowed.json").read_text())
SIZES = {
    "statements": (200, LISTED["statements"]),
    "branches": (12, LISTED["branches"]),
    "locals": (15, LISTED["locals"]),
}
"""Bound of each measure, and what was larger when the bound was set, which may only shrink."""


class Sizes:
    """What is measured in the files of a package.

    Attributes
    ----------
    statements : dict
        By file; without imports and docstrings.
    branches, locals : dict
        By function, as ``file:name``; nested functions count in the outer one, too.
    """

    def __init__(self, root: Path) -> None:
        self.statements: dict[str, int] = {}
        self.branches: dict[str, int] = {}
        self.locals: dict[str, int] = {}
        for path in sorted(root.rglob("*.py")):
            name, tree = str(path.relative_to(root)), tree_of(path)
            self.statements[name] = sum(map(_counts, ast.walk(tree)))
            for function, key in _functions(tree, name):
                nodes = list(ast.walk(function))
                self.branches[key] = sum(isinstance(node, BRANCHES) for node in nodes)
                self.locals[key] = len(
                    {
                        node.id
                        for node in nodes
                        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
                    }
                )


def _counts(node: ast.AST) -> bool:
    text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return (
        isinstance(node, ast.stmt)
        and not text
        and not isinstance(node, ast.Import | ast.ImportFrom)
    )


def _functions(tree: ast.AST, prefix: str):
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            key = f"{prefix}:{node.name}"
            yield node, key
            yield from _functions(node, key)
        elif isinstance(node, ast.ClassDef):
            yield from _functions(node, f"{prefix}:{node.name}")
        else:
            yield from _functions(node, prefix)


if __name__ == "__main__":
    sizes = Sizes(Path(__file__).parents[1] / "petcontact")
    listed = {
        measure: {name: n for name, n in getattr(sizes, measure).items() if n > bound}
        for measure, (bound, _) in SIZES.items()
    }
    print(json.dumps(listed, indent=1))
