"""The folders are the data flow: a module imports only from layers to the left of its own."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2] / "petcontact"
LAYERS = (
    "errors arrays native manual", "runtime geometry compression", "linalg model", "mesh contact", "bem",
    "compliance fields refinement", "results", "pipeline", "sweep compare doctor", "commands",
)  # fmt: skip
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names.split()}
NOT_TO_SEE = {"contact": {"mesh", "bem", "compliance"}, "compression": set(LEVEL) - {"arrays", "native", "compression"}}


def imported(path: Path) -> set[tuple[str, ...]]:
    """Modules of the package that a file imports, anywhere in it, as parts of their names."""
    package = path.relative_to(ROOT).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1] + tuple((node.module or "").split(".")) * bool(node.module)
            found |= {base} if base else {(alias.name,) for alias in node.names}
    return {names for names in found if names[0] in LEVEL}


def test_a_module_imports_from_the_left_only():
    wrong = []
    for path in sorted(ROOT.rglob("*.py")):
        own = path.relative_to(ROOT).with_suffix("").parts
        if len(own) == 1 and own[0] not in ("errors", "arrays"):
            continue                                        # the front door may name everything
        for names in imported(path):
            same = names[0] == own[0]
            apart = names[0] in NOT_TO_SEE.get(own[0], set()) and not same
            twins = {"kelvin2d", "kelvin3d"} <= {*own, *names}
            if apart or twins or not (same or LEVEL[names[0]] < LEVEL[own[0]]):
                wrong.append(f"{'/'.join(own)} imports {'.'.join(names)}")
    assert not wrong, wrong


def test_folders_hold_at_most_a_dozen_entries_and_files_one_concept():
    for folder in [ROOT, *(path for path in ROOT.rglob("*") if path.is_dir() and path.name != "__pycache__")]:
        entries = [path for path in folder.iterdir() if path.name not in ("__init__.py", "__pycache__")]
        entries = [path for path in entries if path.suffix != ".md"]         # chapters of the manual are no modules
        assert folder == ROOT or len(entries) <= 12, folder
    top = {path.name for path in ROOT.iterdir() if path.is_file()}
    assert top == {"__init__.py", "__init__.pyi", "__main__.py", "errors.py", "arrays.py", "py.typed"}
    for path in ROOT.rglob("*.py"):
        assert len(path.read_text().splitlines()) <= 320, path
