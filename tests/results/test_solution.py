"""What a solution offers in Python: data as functions and arrays, forces, and words about them."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example

from petcontact import Contact, InputError, MeshOptions, Solution, Traction, plot_all, solve

COARSE = MeshOptions(element_size=0.2)


@pytest.fixture(scope="module")
def solution():
    return solve(example(1, mesh=COARSE))


def posed(**changes):
    """Example 1 with other conditions on some parts."""
    case = example(1, mesh=COARSE)
    boundary = tuple(changes.get(condition.part, condition) for condition in case.boundary)
    return case.model_copy(update={"boundary": boundary})


def ramp(x, ny):
    return 150.0 + 10.0 * x * ny**2


def test_functions_and_arrays_are_the_expressions_they_stand_for(solution):
    nodes = solution.mesh.nodes_of("bottom")
    given = ("150 + 10*x*ny**2", ramp, 150.0 + 10.0 * solution.mesh.x[nodes, 0])
    found = [solve(posed(bottom=Contact(part="bottom", friction_bound=bound))) for bound in given]
    for other in found[1:]:
        assert np.allclose(other.contact.sigma_t, found[0].contact.sigma_t, rtol=1e-12, atol=1e-9)
    assert not np.allclose(found[0].contact.sigma_t, solution.contact.sigma_t)
    load = Traction(part="left", value=(lambda y: 400.0 + 0.0 * y, np.float32(0.0)))
    assert np.allclose(solve(posed(left=load)).u, solution.u, rtol=1e-10)


@pytest.mark.parametrize(
    ("bound", "message"),
    [
        (lambda x, speed: x, "has a parameter 'speed'; allowed are x, y, nx, ny, s"),
        (lambda x: x + 1j, "returns values of type complex128, expected real numbers"),
        (lambda x: ["1"] * len(x), "returns values of type <U1, expected real numbers"),
        (lambda x: x[:3], r"returns an array of shape \(3,\), expected \(40,\)"),
        (lambda x: 1.0 / (x - x), r"function <lambda> is not finite at x = 0.1"),
        (np.ones(7), "has 7 values, the part has 40 nodes"),
    ],
)
def test_wrong_functions_and_arrays_are_refused(bound, message):
    with np.errstate(divide="ignore"), pytest.raises(InputError, match=message):
        solve(posed(bottom=Contact(part="bottom", friction_bound=bound)))


def test_every_attribute_is_described():
    described = Solution.__doc__.partition("Attributes")[2]
    assert not [name for name in Solution.__dataclass_fields__ if f"    {name} : " not in described]


def test_reactions_balance_the_loads(solution):
    forces = solution.reactions()
    assert forces["left"] == pytest.approx([1600.0, 0.0])
    assert forces["right"] == pytest.approx([0.0, 0.0])
    assert np.abs(sum(forces.values())).max() < 8.0  # of 1600: constant elements
    finer = solve(example(1, mesh=MeshOptions(element_size=0.05)))
    assert np.abs(sum(finer.reactions().values())).max() < 0.6 * np.abs(sum(forces.values())).max()
    contact = solution.contact
    assert forces["bottom"] == pytest.approx(
        [contact.weight @ contact.sigma_t[:, 0], -contact.weight @ contact.sigma_n]
    )
    assert "  bottom: bilateral contact" in solution.verdict()
    assert "reactions: top (" in solution.verdict() and "left (" not in solution.verdict()
    pulled = contact.weight[contact.sigma_n > 0.0].sum() / 8.0
    assert solution.tension_share == pytest.approx(pulled)
    assert f"pulls on about {100 * pulled:.2g} % of it" in solution.verdict()
    assert all(len(line) <= 80 for line in solution.verdict().splitlines())


def test_a_function_is_named_in_files(tmp_path):
    solve(posed(bottom=Contact(part="bottom", friction_bound=ramp))).save(tmp_path / "r.h5")
    read = Solution.load(tmp_path / "r.h5")
    assert read.problem.boundary[0].friction_bound == "<function ramp>"
    assert read.contact.friction_bound[0] > 150.0


def test_mistakes_in_python_are_answered_with_what_is_meant(solution):
    with pytest.raises(KeyError, match="'botom', did you mean 'bottom'"):
        solution.pairs["botom"]
    with pytest.raises(InputError, match=r"'normel' is no figure and no axes; .* mean 'normal'"):
        solution.plot("normel")
    with pytest.raises(InputError, match="no figure 'normel', did you mean 'normal'"):
        plot_all(solution, "", names=["normel"])
    with pytest.raises(InputError, match=r"title: a Problem does not change; .model_copy\(update="):
        solution.problem.title = "another"
    with pytest.raises(
        InputError, match=r"x.vtu: a result is a file .h5 or .hdf5; petcontact field"
    ):
        solution.save("x.vtu")


@pytest.mark.parametrize(
    ("word", "where"),
    [("x", r"\.pairs\[NAME\]\.x"), ("stress", "stress_at"), ("verdikt", "did you mean 'verdict'")],
)
def test_an_attribute_that_is_not_there_is_answered_with_where_it_is(solution, word, where):
    with pytest.raises(AttributeError, match=f"Solution has no '{word}'.*{where}"):
        getattr(solution, word)
    assert not hasattr(solution, "__something__")


def test_names_of_pairs_and_numbers_are_keys(solution):
    with pytest.raises(AttributeError, match=r"names are keys: \['bottom'\]"):
        _ = solution.pairs.bottom
    assert {number.of for number in solution.numbers["force"]} == {"bottom"}
    with pytest.raises(KeyError, match="did you mean 'largest displacement'"):
        _ = solution.numbers["largest displacment"]
