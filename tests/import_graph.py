"""Which files of a package import which: relative, absolute, through the front door, inside
functions, by importlib.

An import inside a function, or one for types only, counts as any other: it says what a file knows
of. Names are those of modules without the package's own ("bem.kernel"; "" is the front door, whose
names are resolved by its stub).
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from pathlib import Path


@functools.cache
def tree_of(path: Path) -> ast.Module:
    """The syntax tree of a file, made once for all that look at it."""
    return ast.parse(path.read_text())


UNKNOWN = "?"
"""An import whose name only the running program knows."""


class ImportGraph:
    """The files of a package, what each imports of it, and what cannot be resolved.

    Parameters
    ----------
    root : Path
        The package's folder.
    """

    def __init__(self, root: Path) -> None:
        self.package = root.name
        self.files = {_name(path.relative_to(root)): path for path in sorted(root.rglob("*.py"))}
        self._front = self._names_of_the_stub(root / "__init__.pyi")
        self.imports: dict[str, set[str]] = {}
        self.unresolved: list[str] = []
        for name, path in self.files.items():
            found = set(self._imported(name, path))
            self.unresolved += [
                f"{name} imports {word}" for word in sorted(found) if word not in self.files
            ]
            self.imports[name] = {word for word in found if word in self.files} - {name, ""}

    def circles(self) -> list[tuple[str, ...]]:
        """Files that import each other, directly or through others: the graph's strongly connected
        components."""
        reached = {name: self._reached(name) for name in self.files}
        parts = {
            tuple(sorted(other for other in reached[name] if name in reached[other]))
            for name in self.files
        }
        return sorted(part for part in parts if part)

    def _reached(self, name: str) -> set[str]:
        """All that a file imports, and what that imports; the file itself only where it comes back
        to it."""
        seen: set[str] = set()
        ahead = [*self.imports[name]]
        while ahead:
            word = ahead.pop()
            if word not in seen:
                seen.add(word)
                ahead += self.imports[word]
        return seen

    def _names_of_the_stub(self, stub: Path) -> dict[str, str]:
        """Where each name of the front door comes from; the version is its own, and says nothing of
        other files."""
        found = {"__version__": ""}
        for node in ast.walk(ast.parse(stub.read_text())):
            if isinstance(node, ast.ImportFrom):
                found |= {alias.asname or alias.name: node.module or "" for alias in node.names}
        return found

    def _imported(self, name: str, path: Path) -> Iterator[str]:
        """Modules that a file imports; where one is not there, the name as it would be."""
        own = name if path.name == "__init__.py" else name.rpartition(".")[0]
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    yield from self._absolute(alias.name)
            elif isinstance(node, ast.ImportFrom):
                base = _above(own, node.level) if node.level else self._inside(node.module or "")
                if base is None:
                    continue
                if node.level and node.module:
                    base = f"{base}.{node.module}".lstrip(".")
                for alias in node.names:
                    yield self._resolved(base, alias.name)
            elif isinstance(node, ast.Call) and (
                getattr(node.func, "attr", getattr(node.func, "id", ""))
                in ("import_module", "__import__")
            ):
                yield from self._by_call(node, own)

    def _inside(self, module: str) -> str | None:
        """The name of an absolute module without the package's, None if it is of another
        package."""
        first, _, rest = module.partition(".")
        return rest if first == self.package else None

    def _absolute(self, module: str) -> Iterator[str]:
        inside = self._inside(module)
        if inside is not None:
            # a bare `import package` gives all that the front door leads to
            yield inside or UNKNOWN

    def _resolved(self, base: str, word: str) -> str:
        """`from base import word`: a module of that name, what the front door leads to, or the base
        itself."""
        inner = f"{base}.{word}".lstrip(".")
        if inner in self.files:
            return inner
        return base if base else self._front.get(word, word)

    def _by_call(self, node: ast.Call, own: str) -> Iterator[str]:
        """importlib.import_module: a constant name, or all modules below the constant beginning of
        one."""
        first = node.args[0] if node.args else None
        if isinstance(first, ast.Constant):
            start, whole = str(first.value), True
        elif isinstance(first, ast.JoinedStr) and isinstance(first.values[0], ast.Constant):
            start, whole = str(first.values[0].value), False
        else:
            yield UNKNOWN
            return
        if start.startswith("."):
            dots = len(start) - len(start.lstrip("."))
            start = f"{_above(own, dots)}.{start.lstrip('.')}".strip(".")
        else:
            inside = self._inside(start)
            if inside is None:
                return
            start = inside.strip(".") or UNKNOWN
        yield from (
            [start] if whole else [name for name in self.files if name.rpartition(".")[0] == start]
        )


def _name(path: Path) -> str:
    """The module that a file is, from its path inside the package."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _above(own: str, level: int) -> str:
    """The package that `level` dots mean in a module of the package `own`."""
    parts = own.split(".") if own else []
    return ".".join(parts[: len(parts) - level + 1])
