"""Result files: whole or not there, the same when read back, and refused in one line when they are
anything else."""

from __future__ import annotations

import dataclasses
import errno
import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from examples import example
from shapes import drawn, elastic, moved, problem, touching

from petcontact import MeshOptions, solve
from petcontact.errors import OutputError, ResultError
from petcontact.results.format.container import write_atomically
from petcontact.results.hdf5 import write_solution
from petcontact.results.solution import read_result

pytestmark = pytest.mark.usefixtures("unsampled")


@pytest.fixture(scope="module")
def solution(comm):
    return solve(example(1, mesh=MeshOptions(element_size=0.5)), comm=comm)


@pytest.fixture
def path(solution, tmp_path):
    write_solution(tmp_path / "result.h5", solution)
    return tmp_path / "result.h5"


def refused(path, message):
    with pytest.raises(ResultError, match=message) as caught:
        read_result(path)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_a_config_of_more_than_64_kb(solution, tmp_path):
    """Attributes of HDF5 hold no more unless they are stored apart."""
    many = solution.problem.model_copy(update={"title": "x" * 70_000})
    write_solution(tmp_path / "r.h5", dataclasses.replace(solution, problem=many))
    assert read_result(tmp_path / "r.h5").problem == many


def test_a_law_that_names_no_bounds(tmp_path):
    class Bare:
        def __init__(self, law):
            self.k, self.groups, self.project = law.k, law.groups, law.project
            self.linearise, self.states = law.linearise, law.states

    problem = example(1, mesh=MeshOptions(element_size=0.5))
    bare = solve(problem, law=lambda nodes: Bare(nodes.law))
    write_solution(tmp_path / "r.h5", bare)
    again = read_result(tmp_path / "r.h5")
    assert again.verdict() == bare.verdict()
    (q,) = (each.value for each in again.numbers if each.name == "largest q")
    assert q == pytest.approx(150.0)


def test_a_result_needs_no_file_of_the_problem(tmp_path):
    file = tmp_path / "plate.msh"
    file.write_bytes((Path(__file__).parents[1] / "data/plate_v41.msh").read_bytes())
    tools = [
        {"name": name, "shape": "circle", "centre": [x, 4.0], "radius": 1.0}
        for name, x in (("left", 1.0), ("right", 3.0))
    ]
    solution = solve(
        problem(
            material=elastic(1000.0, 0.3),
            geometry={"shape": "gmsh", "file": str(file)},
            mesh={"element_size": 0.25},
            boundary=[
                moved("bottom", [0.0, 0.01]),
                *(drawn(p, [0.0, 0.0]) for p in ("sides", "9")),
            ],
            obstacle=tools,
            contact=[touching("tools", "top", ["left", "right"])],
        )
    )
    write_solution(tmp_path / "r.h5", solution)
    file.unlink()
    again = dataclasses.replace(read_result(tmp_path / "r.h5"), written=None)
    assert again.gap_edges.keys() == solution.nodes.keys()
    first, second = ([(n.name, str(n.value)) for n in s.numbers] for s in (solution, again))
    assert first == second


def test_truncated_and_foreign_files_are_refused(path):
    whole = path.read_bytes()
    for fraction in (0.0, 0.5, 0.999):
        path.write_bytes(whole[: int(fraction * len(whole))])
        refused(path, "not a whole HDF5 file|damaged|not a result")
    for content in (b"text", b"\x89HDF\r\n\x1a\n", b"\0" * 10_000):
        path.write_bytes(content)
        refused(path, "not a whole HDF5 file")


def test_hdf5_of_another_program_and_of_another_version(path):
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = 2
    refused(path, "format version 2, this is 3")
    with h5py.File(path, "w") as file:
        file["x"] = 1
    refused(path, "not a result of petcontact")


def test_files_that_are_not_there(tmp_path):
    refused(tmp_path / "no.h5", "no such file")
    refused(tmp_path, "no such file")
    refused(tmp_path / "\0", "no such file")


# --- writing
# --------------------------------------------------------------------------------------------------
def test_a_failing_write_leaves_the_old_file_and_nothing_else(path):
    before = path.read_bytes()

    def fill(file):
        file["x"] = np.zeros(1000)
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OutputError, match=r"cannot be written \(No space left on device\)"):
        write_atomically(path, fill)
    assert path.read_bytes() == before and os.listdir(path.parent) == [path.name]


# --- files that were tampered with
# ---------------------------------------------------------------------------------
def replaced(file, name, values):
    del file[name]
    file[name] = values


def external(file, name):
    shape, dtype = file[name].shape, file[name].dtype
    del file[name]
    file.create_dataset(name, shape, dtype, external=[("/etc/hostname", 0, h5py.h5f.UNLIMITED)])


def claimed(file, name):
    del file[name]
    file.create_dataset(name, (2**40, 2), "f8", chunks=(1024, 2))


def to(function):
    return lambda file, name: replaced(file, name, function(file[name][()]))


def with_value(value):
    def change(values):
        values = values.copy()
        values.reshape(-1)[3] = value
        return values

    return change


TAMPERED = {
    "short": (
        to(lambda v: v[:-1]),
        "boundary/u steps/1/contact/bottom/slip pairs/bottom/nodes mesh/order",
    ),
    "more columns": (
        to(lambda v: np.hstack([v, v])),
        "boundary/u steps/1/contact/bottom/slip mesh/vertices",
    ),
    "scalar": (to(lambda v: v.ravel()[0]), "boundary/u steps/1/contact/bottom/weight mesh/part"),
    "nan": (
        to(with_value(np.nan)),
        "boundary/u steps/1/contact/bottom/slip mesh/vertices mesh/curvature",
    ),
    "complex": (to(lambda v: v + 1j), "boundary/u steps/1/contact/bottom/sigma_t"),
    "large": (to(with_value(10**9)), "pairs/bottom/nodes mesh/elements mesh/order mesh/part"),
    "negative": (
        to(with_value(-1)),
        "pairs/bottom/nodes steps/1/contact/bottom/state mesh/order mesh/elements",
    ),
    "fractions": (to(lambda v: v + 0.5), "pairs/bottom/nodes mesh/elements mesh/part"),
    "words": (to(lambda v: np.array([b"x"] * len(v))), "boundary/u mesh/order"),
    "missing": (
        lambda file, name: file.__delitem__(name),
        "bodies/body/mesh steps/1/contact/bottom/slip history/rho boundary/u mesh/order",
    ),
    "external": (external, "boundary/u steps/1/contact/bottom/slip"),
    "link": (to(lambda v: h5py.ExternalLink("other.h5", "/x")), "boundary/u pairs/bottom/nodes"),
    "soft link": (to(lambda v: h5py.SoftLink("/boundary/u")), "boundary/traction"),
    "claimed": (claimed, "boundary/u"),
}
"""A change of a dataset, and the datasets that it is made of."""


@pytest.mark.parametrize("kind", TAMPERED)
def test_a_tampered_file_is_refused_in_one_line(path, kind):
    """Never drawn, never started from: wrong lengths and types, numbers of nodes that are not
    there, data elsewhere."""
    change, names = TAMPERED[kind]
    whole = path.read_bytes()
    for name in names.split():
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            change(file, name)
        refused(path, ".")


def test_a_group_that_holds_itself_is_no_endless_work(path):
    with h5py.File(path, "r+") as file:
        for name in "abcdefgh":
            file["boundary"][name] = file["boundary"]
            file["boundary"]["root" + name] = file["/"]
    assert read_result(path).converged


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("accuracy", "[]", "accuracy is not a table"),
        ("provenance", "[]", "provenance is not a table"),
        ("timings", '{"mesh": "long"}', "timings is not a table of numbers"),
        ("config", "not = = this", "."),
        ("history/rho", np.ones(3), r"history has columns of 3, \d+ rows"),
    ],
)
def test_attributes_and_columns_that_are_something_else(path, name, value, message):
    with h5py.File(path, "r+") as file:
        if "/" in name:
            replaced(file, name, value)
        else:
            file.attrs[name] = value
    refused(path, message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file: file["steps/1"].attrs.__setitem__("step", 3), "of step 3"),
        (lambda file: file["steps/1"].attrs.__setitem__("step", 0), "of step 0"),
        (lambda file: file["steps/1"].attrs.__setitem__("origin", 2), "of origin 2"),
        (lambda file: file["steps"].__setitem__("2", file["steps/1"]), "increment 1 again"),
    ],
)
def test_increments_that_the_problem_does_not_have_are_refused(path, change, message):
    with h5py.File(path, "r+") as file:
        change(file)
    refused(path, message)
