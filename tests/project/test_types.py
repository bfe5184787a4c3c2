"""What `from petcontact import ...` offers, and that importing it stays cheap; the types of it are
checked by mypy on users_script.py."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pydantic

import petcontact
from petcontact.given.tables.model_tree import models_below

ROOT = Path(__file__).parents[2]


def test_every_typed_name_is_there_and_none_else():
    stub = (ROOT / "petcontact" / "__init__.pyi").read_text()
    named = re.findall(r"^from \.\S+ import (\w+) as \1$", stub, re.MULTILINE)
    assert len(named) > 30 and sorted(named) == sorted(petcontact.__all__)
    for name in named:
        assert getattr(petcontact, name).__name__ == name


def test_all_that_a_problem_is_made_of_has_a_name():
    offered = {getattr(petcontact, name) for name in petcontact.__all__}
    assert {*models_below(petcontact.Problem)} <= offered


def run(program):
    # PETSc, once started in this process, has put variables of a launcher into its environment that
    # Python does not know of; where lines are measured, coverage imports modules of its own
    given = {key: value for key, value in os.environ.items() if not key.startswith("COVERAGE_")}
    given |= {"OPENBLAS_NUM_THREADS": "1"}
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=300, env=given)
    assert done.returncode == 0, done.stderr
    return {*done.stdout.splitlines()[-1].split()}


def test_nothing_heavy_is_imported_before_it_is_used():
    loaded = run("import sys, petcontact; dir(petcontact); print(*sys.modules)")
    heavy = {"numpy", "scipy", "pydantic", "h5py", "petsc4py", "mpi4py", "shapely"}
    assert "petcontact" in loaded and not heavy & loaded


def test_words_are_read_without_numpy():
    """Help and mistakes in words are answered at once, and a limit of the address space is told
    before a library meets it."""
    words = "from petcontact.commands.main import main, split_arguments as split"
    loaded = run(
        f"import sys\n{words}\nsplit(['solve', 'a.toml', '-ksp_view'])\nprint(*sys.modules)"
    )
    assert "petcontact.runtime.memory" in loaded and not {"numpy", "petsc4py"} & loaded


def test_a_plane_solve_without_figures_imports_nothing_for_other_work(tmp_path):
    words = ["solve", str(ROOT / "configs/example1.toml"), "--no-figures"]
    words += ["-o", str(tmp_path / "result.h5")]
    main = "from petcontact.commands.main import main"
    loaded = run(f"import sys\n{main}\nmain({words})\nprint(*sys.modules)")
    assert {"numpy", "petcontact.pipeline.solve", "petcontact.results.hdf5"} <= loaded
    others = """matplotlib meshio pandas polars rich xml html multiprocessing gmsh shapely
        scipy.optimize scipy.stats scipy.fft scipy.interpolate scipy.integrate threadpoolctl
        petcontact.pipeline.adapt.loop petcontact.sweep petcontact.fatigue petcontact.convert
        petcontact.compare petcontact.doctor petcontact.compression.hodlr
        petcontact.compression.hmatrix petcontact.results.vtu petcontact.results.figures
        petcontact.contact.methods.tao mpi4py petcontact.given.shapes
        petcontact.bem.particular.fitted_loads petcontact.mesh.pairs.matching
        petcontact.compliance.body.superelement petcontact.compliance.half_space
        petcontact.compliance.layer petcontact.pipeline.adapt.surface_errors
        petcontact.contact.active_set.complementarity"""
    assert not {*others.split()} & loaded


def test_help_shows_how_a_shape_is_written():
    """By place first, then what is by name only; defaults as they are."""
    text = str(inspect.signature(petcontact.Rectangle))
    assert text.startswith("(lower_left: 'Point', upper_right: 'Point', *, shape:")
    for name in dir(petcontact):
        kind = getattr(petcontact, name)
        if inspect.isclass(kind) and issubclass(kind, pydantic.BaseModel):
            given = inspect.signature(kind).parameters
            fields = {*kind.model_fields, *kind.spelling({}).model_fields}
            assert {key.rstrip("_") for key in given} == fields and kind.__doc__, name


def test_help_shows_what_is_ours(capsys):
    """Without the 480 lines of pydantic's base class, and with all that a problem may be given."""
    for kind in (petcontact.Problem, petcontact.Material, petcontact.Rectangle):
        assert not [name for name in dir(kind) if "pydantic" in name or name.startswith("model_")]
        help(kind)
        text = capsys.readouterr().out
        assert "pydantic_" not in text and text.count("\n") < 160
    given = inspect.signature(petcontact.Problem).parameters
    assert {"material", "geometry", "boundary", "body", "step"} <= {*given}
    assert given["material"].default is ... and given["boundary"].kind.name == "KEYWORD_ONLY"
    assert "poisson_ratio" in dir(petcontact.Material(1.0, 0.3))
