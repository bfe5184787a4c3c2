"""The folders are the data flow: a module imports only from layers to the left of its own, and no
files in a circle."""

from __future__ import annotations

import functools
from pathlib import Path

import pytest
from code_sizes import SIZES, Sizes
from import_graph import ImportGraph

ROOT = Path(__file__).parents[2] / "petcontact"
LAYERS = (
    "errors untyped",
    "record",
    "arrays native manual",
    "round_off stored",
    "reference runtime geometry compression",
    "linalg given",
    "model",
    "mesh contact",
    "bem",
    "compliance fields refinement",
    "results",
    "pipeline",
    "sweep compare convert doctor fatigue",
    "commands",
)
FRONT = {"", "__main__"}
"""What may name everything: the front door, and the program."""
ONLY = {
    "compression": {"arrays", "native", "record", "untyped"},
    "reference": {"errors", "arrays", "record"},
}
"""Folders that know less than their layer may."""
NOT_TO_SEE = {
    "contact": {"mesh", "bem", "compliance"},
    "bem.kelvin2d": {"bem.kelvin3d"},
    "bem.kelvin3d": {"bem.kelvin2d"},
}
PROTOCOL = ("contact", "contact.system", {"mesh", "bem", "compliance", "fields"})
"""A folder, the only module of it that others may know, and these others."""
BELOW_THE_DOOR = ["mesh", "contact", "bem", "compliance", "fields", "refinement", "pipeline"]
"""Folders that know a problem as it is posed, by numbers and functions of the place."""
KNOW_THE_CONFIG = """pipeline.solve pipeline.run pipeline.public_operators pipeline.pose.discretise
    pipeline.pose.body_parts pipeline.pose.as_posed pipeline.adapt.loop pipeline.adapt.level_solver
    pipeline.adapt.fixed_mesh"""
"""Files among them that import `model`: the doors. The list may only shrink."""
ANY_MODULE = {"sweep.quantities"}
"""Where a module is imported whose name a user gives."""


@functools.cache
def graph_of(root: Path) -> ImportGraph:
    return ImportGraph(root)


def violations(root: Path, layers=LAYERS) -> set[str]:
    """What breaks the rules for single imports, in a line each."""
    graph = graph_of(root)
    level = {name: number for number, names in enumerate(layers) for name in names.split()}
    tops = {name.partition(".")[0] for name in graph.files} - FRONT
    wrong = {f"{name} is in no layer" for name in tops - level.keys()}
    wrong |= {f"{name} is not there" for name in level.keys() - tops}
    wrong |= {line for line in graph.unresolved if line.partition(" ")[0] not in ANY_MODULE}
    for own, imports in graph.imports.items():
        if own not in FRONT:
            wrong |= {f"{own} imports {name}" for name in imports if not allowed(own, name, level)}
    return wrong


def allowed(own: str, name: str, level: dict[str, int]) -> bool:
    """Whether a module may import another."""
    mine, other = own.partition(".")[0], name.partition(".")[0]
    folder, door, guests = PROTOCOL
    if any(
        within(own, key) and any(within(name, hidden) for hidden in NOT_TO_SEE[key])
        for key in NOT_TO_SEE
    ):
        return False
    if mine == other or not {mine, other} <= level.keys():
        return True  # an unknown folder is reported as such
    if mine in guests and other == folder and name != door:
        return False
    return level[other] < level[mine] and other in ONLY.get(mine, level)


def within(name: str, folder: str) -> bool:
    return f"{name}.".startswith(f"{folder}.")


def test_a_module_imports_from_the_left_only():
    assert violations(ROOT) == set()


def test_below_the_door_nobody_knows_the_config():
    """What is given became values in `Problem.posed`: no text of a config is read later."""
    imports = graph_of(ROOT).imports
    knowing = {
        own
        for own, names in imports.items()
        if own.partition(".")[0] in BELOW_THE_DOOR and any(within(name, "model") for name in names)
    }
    assert knowing == {*KNOW_THE_CONFIG.split()}


def test_no_files_import_each_other_in_a_circle():
    assert set(graph_of(ROOT).circles()) == set()


def test_programs_that_run_by_their_files_import_nothing_of_the_package():
    """Beside Gmsh, where a relative import has no package: names of STEP files were not read."""
    imports = graph_of(ROOT).imports
    assert not imports["geometry.cad.worker"] and not imports["geometry.cad.step_names"]


def test_the_top_holds_the_doors_only():
    doors = "__init__.py __init__.pyi __main__.py py.typed"
    every = f"{doors} errors.py arrays.py record.py stored.py round_off.py untyped.py"
    assert {path.name for path in ROOT.iterdir() if path.is_file()} == {*every.split()}


def test_files_and_functions_stay_small():
    """Counts do not depend on the format; what was larger before the rule is listed, and may only shrink."""
    sizes = Sizes(ROOT)
    for measure, (bound, allowed) in SIZES.items():
        large = {name: n for name, n in getattr(sizes, measure).items() if n > bound}
        grown = {name: n for name, n in large.items() if n > allowed.get(name, bound)}
        assert not grown, f"{measure}: at most {bound}"
        gone = {name for name, n in allowed.items() if large.get(name, 0) < n}
        assert not gone, f"{measure}: smaller now, so write it into the list"


# --- the rules themselves, on packages made for them

SMALL = ("errors arrays", "mesh contact", "bem", "compliance", "pipeline sweep")
STUB = "from .errors import Bad as Bad\nfrom .pipeline.run import solve as solve\n"
MODULES = """errors arrays mesh/panels contact/system contact/laws bem/kernel bem/kelvin2d/tensors
    bem/kelvin3d/tensors compliance/dense pipeline/run sweep/quantities sweep/run"""
TEXTS = {
    "pipeline/run": "from ..compliance.dense import S\nfrom .. import Bad, __version__\n",
    "compliance/dense": "from ..contact.system import Modes\nfrom ..errors import Bad\n",
}


@pytest.fixture
def house(tmp_path):
    """A package without a fault, and a function that puts text into its files."""
    root = tmp_path / "petcontact"

    def build(files=None) -> Path:
        for name, text in (files or {}).items():
            path = root / f"{name}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            (path.parent / "__init__.py").touch()
            path.write_text(text)
        return root

    build({name: TEXTS.get(name, "import numpy as np\n") for name in MODULES.split()})
    (root / "__init__.pyi").write_text(STUB)
    return build


def test_a_house_without_a_fault_has_none(house):
    """The front door may be asked for what lies to the left."""
    house({"bem/kernel": "from .. import Bad, __version__"})
    assert violations(house(), SMALL) == set()
    assert ImportGraph(house()).circles() == []


WRONG = {
    "bem/a": ("from ..pipeline.run import solve", "pipeline.run"),
    "bem/b": ("def f():\n    from ..pipeline import run", "pipeline.run"),
    "bem/e": ("from petcontact import solve", "pipeline.run"),
    "bem/f": ("from .. import nothing", "nothing"),
    "bem/g": ("import petcontact", "?"),
    "bem/k": ("import_module(f'..sweep.{n}', __package__)", "sweep.run"),
    "bem/l": ("importlib.import_module(n)", "?"),
    "mesh/m": ("from ..contact import system", "contact.system"),
    "contact/n": ("from ..mesh import panels", "mesh.panels"),
    "compliance/o": ("from ..contact.laws import Tresca", "contact.laws"),
    "bem/kelvin2d/p": ("from ..kelvin3d import tensors", "bem.kelvin3d.tensors"),
    "compression/q": ("from ..errors import Bad", "errors"),  # kernels see arrays only
}
"""Files that break a rule each, and what they must not import."""


def test_each_rule_fails_where_it_is_broken(house):
    root = house({"attic/old": "x = 1", **{name: text for name, (text, _) in WRONG.items()}})
    found = violations(root, (SMALL[0], "compression cellar", *SMALL[1:]))
    wrong = {f"{name.replace('/', '.')} imports {word}" for name, (_, word) in WRONG.items()}
    assert wrong | {"attic is in no layer", "cellar is not there"} <= found


def test_circles_are_found_through_three_files_and_inside_functions(house):
    root = house(
        {
            "mesh/a": "from .b import x",
            "mesh/b": "def f():\n    from . import c",
            "mesh/c": "import petcontact.mesh.a",
            "mesh/d": "from . import a",
            "bem/e": "from .kernel import K",
        }
    )
    assert ImportGraph(root).circles() == [("mesh.a", "mesh.b", "mesh.c")]
