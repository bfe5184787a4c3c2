"""Whatever is in a config: one line and an `InputError`, or a problem that can be discretised;
never anything else."""

from __future__ import annotations

import contextlib
import copy
import os
import string
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from petcontact import InputError, SolverError
from petcontact.commands.main import main
from petcontact.given.sites import Sites
from petcontact.given.values import as_given
from petcontact.model.case import load, parse_problem
from petcontact.pipeline.judge.findings import limit_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.solve import solve

pytestmark = pytest.mark.usefixtures("unsampled")

EXAMPLE = tomllib.loads((Path(__file__).parents[2] / "configs" / "example1.toml").read_text())
EXAMPLE["mesh"]["element_size"] = 1.0
PATIENT = settings(
    max_examples=50, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)
LONGEST = 120.0  # seconds: only what hangs takes so long, however loaded the machine is

numbers = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0.0, -0.0, 1e-300, 1e300, -1e308, 5e-324, 10**400, 2**63, True]),
)
scalars = st.one_of(numbers, st.text(max_size=20), st.just(b"bytes"), st.none(), st.dates())
values = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=3)
    ),
    max_leaves=8,
)


def paths(tree, head=()):
    """Every key of nested data."""
    items = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    for key, value in items:
        yield (*head, key)
        yield from paths(value, (*head, key))


PATHS = list(paths(EXAMPLE))


def changed(path, value):
    result = copy.deepcopy(EXAMPLE)
    here = result
    for step in path[:-1]:
        here = here[step]
    here[path[-1]] = value
    return result


def one_line(call):
    """The result of a call that may only end well or with an error of one line, and in time."""
    began = time.monotonic()
    try:
        return call()
    except (InputError, SolverError) as error:
        assert "\n" not in str(error) and 0 < len(str(error)) < 1500
        return None
    finally:
        assert time.monotonic() - began < LONGEST


def discretised(data):
    case = parse_problem(data, "c.toml", {}, Path())
    return discretise(case)


@PATIENT
@given(st.sampled_from(PATHS), values)
def test_any_value_at_any_key(path, value):
    one_line(lambda: discretised(changed(path, value)))


@PATIENT
@given(
    st.sampled_from([path[:-1] for path in PATHS if isinstance(path[-1], str)]),
    st.text(max_size=12),
    values,
)
def test_any_unknown_key_anywhere(table, key, value):
    one_line(lambda: discretised(changed((*table, key), value)))


@PATIENT
@given(st.sets(st.sampled_from(PATHS), min_size=1, max_size=3))
def test_missing_keys(removed):
    data = copy.deepcopy(EXAMPLE)
    for path in sorted(removed, key=len, reverse=True):
        here = data
        with contextlib.suppress(KeyError, IndexError):
            for step in path[:-1]:
                here = here[step]
            del here[path[-1]]
    one_line(lambda: discretised(data))


finite = st.floats(allow_nan=False, allow_infinity=False)


@PATIENT
@given(
    st.lists(
        st.tuples(finite | st.integers(-3, 3), finite | st.integers(-3, 3)), min_size=3, max_size=7
    ),
    finite,
)
def test_outlines_that_cross_or_degenerate(vertices, size):
    n = len(vertices)
    data = EXAMPLE | {
        "geometry": {
            "shape": "polygon",
            "vertices": [list(v) for v in vertices],
            "parts": [f"p{k}" for k in range(n)],
        },
        "mesh": {"element_size": abs(size) or 1.0},
        "boundary": [{"part": "p0", "condition": "contact", "friction_bound": 1.0}]
        + [
            {"part": f"p{k}", "condition": "displacement", "value": [0.0, 0.0]} for k in range(1, n)
        ],
    }
    one_line(lambda: discretised(data))


@PATIENT
@given(
    st.binary(max_size=200)
    | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass"))
)
def test_any_bytes_as_a_file(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "fuzz.toml"
    path.write_bytes(content)
    one_line(lambda: load(path))


powers = st.integers(-60, 60).map(lambda k: 10.0**k)


@settings(PATIENT, max_examples=30)
@given(
    st.fixed_dictionaries(
        {
            "material.young_modulus": powers,
            "material.poisson_ratio": st.sampled_from([-0.999999999, 0.0, 0.499999999999]),
            "boundary.0.friction_bound": powers | st.just(0.0),
            "boundary.2.value": st.tuples(powers, powers).map(list),
            "boundary.1.value": st.tuples(powers, st.just("free")).map(list),
            "method.rho": powers,
            "method.max_iterations": st.integers(1, 60),
            "method.rule": st.sampled_from(["fixed", "self-adaptive", "modified"]),
            "method.formulation": st.sampled_from(["condensed", "full"]),
            "mesh.order": st.integers(0, 2),
            "mesh.grading": st.sampled_from([1e-300, 1e-3, 0.5, 0.999999]),
            "mesh.levels": st.sampled_from([1, 5, 60]),
            "mesh.element_size": st.sampled_from([0.5, 100.0]),
        }
    )
)
def test_badly_scaled_problems_end(comm, changes):
    """A solution whose status says what was checked, or one line; no warning of numpy, no exception
    of another kind."""
    solution = one_line(
        lambda: solve(parse_problem(copy.deepcopy(EXAMPLE), "c.toml", changes, Path()), comm=comm)
    )
    if solution is not None and solution.converged:
        assert solution.last.residuals["elastic"] <= limit_of("elastic residual")
        assert np.isfinite(solution.last.residuals["tangential"])
        assert np.all(np.isfinite(solution.u)) and np.all(np.isfinite(solution.traction))


# --- expressions
# --------------------------------------------------------------------------------------------------
X = np.linspace(-1.0, 1.0, 7)
NAMES = "x y pi e sin where max abs x.T __import__ open exec True None self"
pieces = (
    NAMES.split()
    + list("+-*/%()[]{},.<>=!&|~^:;'\"\\@# \n\t0129")
    + ["**", "//", "==", "1e308", "9" * 30, " if "]
)
texts = st.lists(st.sampled_from(pieces), max_size=25).map("".join) | st.text(max_size=60)


def value_of(text):
    sites = Sites(np.column_stack([X, X]))
    result = one_line(lambda: as_given(text, "key").at(sites))
    assert np.array_equal(sites.x, np.column_stack([X, X]))  # nothing was written over
    return result


@settings(PATIENT, max_examples=80)
@given(texts)
def test_any_text_as_an_expression(text):
    result = value_of(text)
    assert result is None or (result.shape == X.shape and np.all(np.isfinite(result)))


HARMLESS = {"(" * 150 + "x" + ")" * 150, "-" * 499 + "x"}
ATTACKS = [
    "__import__('os').system('touch stolen')",
    "().__class__.__bases__[0].__subclasses__()",
    "x.tofile('stolen')",
    "sin.__class__",
    "sin(x, out=x)",
    "sin(x, x)",
    "where(x, x, x, x)",
    "9**9**9**9**9**9",
    "2**(2**(2**(2**2)))*9**99999",
    "(" * 300 + "x" + ")" * 300,
    *sorted(HARMLESS),
    "f'{1:999999999}'",
    "'a'*10**9",
    "[i for i in range(10**9)]",
    "(lambda: 1)()",
    "x if x else y",
    "open('stolen', 'w')",
    "exec('1')",
    "globals()",
    "x := 5",
    "import os",
    "1/0",
    "0**-1",
    "1e999",
    "nan",
    "x[0]",
    "{}",
    "...",
    "1j",
    "await x",
    "*x",
    "x" * 500,
    "\N{GREEK SMALL LETTER OMEGA}",
    "x\x00",
    "#",
    "",
    "1_0__0",
    "~1",
    "not x",
    "1 << 999999999",
]


@pytest.mark.parametrize("text", ATTACKS, ids=range(len(ATTACKS)))
def test_hostile_expressions_are_refused_and_touch_nothing(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SECRET", "1")
    before = dict(os.environ)
    assert value_of(text) is None or text in HARMLESS
    assert os.listdir(tmp_path) == [] and dict(os.environ) == before


# --- the command line
# ----------------------------------------------------------------------------------------------
LINE = """solve plot c.toml missing.toml -o out.h5 --force --set method.rho=-1 --fig --no-figures
--unknown - -- -h --version -o= --set=a.b.c=1 = -1"""
words = st.lists(
    st.sampled_from(["", *LINE.split()])
    | st.text(string.printable, max_size=6).filter(
        lambda word: not word.startswith("-") or len(word) < 2
    ),
    max_size=6,
)


@PATIENT
@given(words)
def test_any_command_line(tmp_path_factory, arguments):
    """Configs here are bad, so that nothing is ever solved: the status is 2, or 0 for --help and
    --version."""
    folder = tmp_path_factory.getbasetemp() / "line"
    folder.mkdir(exist_ok=True)
    (folder / "c.toml").write_text("title = 5")
    here = Path.cwd()
    os.chdir(folder)
    try:
        with (
            open(os.devnull, "w") as sink,
            contextlib.redirect_stdout(sink),
            contextlib.redirect_stderr(sink),
        ):
            try:
                status = main(arguments)
            except SystemExit as end:
                status = end.code
    finally:
        os.chdir(here)
    assert status in (0, 2)
    assert os.listdir(folder) == ["c.toml"]
