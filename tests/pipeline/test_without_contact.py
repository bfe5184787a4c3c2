"""Elastostatics without contact goes the same way as everything else: bars whose fields are known,
on every storage."""

from __future__ import annotations

import re

import numpy as np
import pytest
from marks import slow
from shapes import cuboid, drawn, elastic, problem, rectangle, rollers, solid

from petcontact import adapt, solve
from petcontact.errors import InputError
from petcontact.pipeline.adapt import traction_ladder
from petcontact.pipeline.adapt.difference import displacement_difference

pytestmark = pytest.mark.usefixtures("unsampled")

YOUNG, POISSON, PULL = 1000.0, 0.3, 2.0


def bar(d, name="bar", pull=PULL, **mesh):
    """A bar from the origin to (4, 1) or (4, 1, 1), on rollers at the planes of the axes, pulled
    along x."""
    return solid(
        name,
        (rectangle, cuboid)[d - 2]([0.0] * d, [4.0, *[1.0] * (d - 1)]),
        *rollers(*(["left", "bottom"] if d == 2 else ["left", "front", "bottom"])),
        drawn("right", [pull, *[0.0] * (d - 1)]),
        material=elastic(YOUNG, POISSON) | ({"plane": "stress"} if d == 2 else {}),
        mesh={"element_size": 0.5, "order": 1, **mesh},
    )


def stretched(x, pull=PULL):
    return pull / YOUNG * x * np.array([1.0, *[-POISSON] * (x.shape[1] - 1)])


@pytest.mark.parametrize(
    ("d", "petsc"),
    [(2, {}), (2, {"bem_mat_type": "hodlr"}), (3, {}), slow(3, {"bem_mat_type": "hmatrix"})],
)
def test_a_bar_is_stretched_as_it_should(d, petsc):
    solution = solve(problem(body=[bar(d)]), petsc_options=petsc)
    assert solution.converged and "nothing is in contact" in solution.reason and not solution.pairs
    assert not solution.zones
    exact = stretched(solution.mesh.x)
    assert np.abs(solution.u - exact).max() < 1e-4 * np.abs(exact).max()
    inside = solution.stress_at([[2.0, 0.4, 0.6][:d]])
    assert np.allclose(inside, [[PULL, *[0.0] * (2 if d == 2 else 5)]], atol=1e-3 * PULL)
    assert np.allclose(solution.reactions()["left"], [-PULL, *[0.0] * (d - 1)], atol=1e-3 * PULL)
    said = solution.verdict()
    assert "largest displacement: " in said and re.search(r"reactions: bar.left \(-2[.0]*, 0", said)
    assert len(solution.to_dataframe()) == 0 and len(solution.contact.x) == 0


def test_bodies_steps_and_the_error_of_u():
    """Two bodies, one pulled more in a second step; what coarse elements of order 0 miss is
    estimated."""
    more = {"body": "other", "part": "right", "value": [3.0 * PULL, 0.0]}
    steps = [{"name": "both"}, {"name": "more", "increments": 2, "boundary": [more]}]
    solution = solve(problem(body=[bar(2), bar(2, "other", 2.0 * PULL)], step=steps))
    ends = [step.bodies["other"].u for step in solution.steps]
    x = solution.meshes["other"].x
    assert len(ends) == 3
    for u, pull in zip(ends, (2.0, 2.5, 3.0), strict=True):
        assert np.allclose(u, stretched(x, pull * PULL), atol=1e-9)
    rough = solve(problem(body=[bar(2, order=0, element_size=0.1)]))
    missed = np.linalg.norm(rough.u - stretched(rough.mesh.x)) / np.linalg.norm(rough.u)
    assert 0.3 * missed < rough.accuracy.error < 10.0 * missed
    assert "error of u:" in rough.verdict()


@pytest.mark.parametrize("steps", [{}, {"step": [{"increments": 2}]}], ids=["none", "steps"])
def test_a_result_is_gone_on_from(steps, tmp_path):
    """There was no array of a pair to join."""
    first = solve(problem(body=[bar(2)], **steps))
    first.save(tmp_path / "r.h5")
    for count in ["", ":1"] if steps else [""]:
        start = {"start": f"{tmp_path / 'r.h5'}{count}"}
        assert np.array_equal(solve(problem(body=[bar(2)], **steps, method=start)).u, first.u)
    # loads without steps are one step
    more = {"body": "bar", "part": "right", "value": [3.0 * PULL, 0.0]}
    on = [*(steps or {"step": [{"name": "load"}]})["step"], {"name": "more", "boundary": [more]}]
    further = solve(problem(body=[bar(2)], step=on, method={"start": f"{tmp_path / 'r.h5'}"}))
    assert np.allclose(further.u, 3.0 * first.u, rtol=1e-9)


def test_what_needs_contact_is_refused():
    punch = {"name": "punch", "displacement": [0.0, 0.0]}
    with pytest.raises(InputError, match=r"obstacle 'punch': no part is in contact"):
        solve(problem(body=[bar(2)], obstacle=[punch]))
    with pytest.raises(InputError, match=r"method\.formulation"):
        solve(problem(body=[bar(2)], method={"formulation": "full"}))


def test_an_accuracy_of_u_is_reached():
    """`accuracy` counts without contact as with it."""
    rough, fine = (
        adapt(problem(body=[bar(2, pull=PULL, order=None, element_size=None)]), accuracy)
        for accuracy in (1e-2, 1e-6)
    )
    assert rough.converged and fine.converged and fine.accuracy.error <= 1e-6
    assert fine.mesh.n_nodes >= rough.mesh.n_nodes


def test_two_meshes_show_the_error_of_u_where_a_third_is_dear(monkeypatch):
    clamped = solid(
        "clamped",
        rectangle([0.0, 0.0], [4.0, 1.0]),
        {"part": "left", "condition": "displacement", "value": [0.0, 0.0]},
        drawn("right", [0.0, PULL]),
    )
    three = adapt(problem(body=[clamped]))
    monkeypatch.setattr(traction_ladder, "BUDGET", 0.0)
    two = adapt(problem(body=[clamped]))
    assert (len(two.accuracy.elements), len(three.accuracy.elements)) == (2, 3)
    assert 0.0 < displacement_difference(two, three) < two.accuracy.error <= two.accuracy.wanted


def test_tractions_balance_up_to_the_digits_of_numbers_in_files():
    """A strip drawn at both ends, nearly equally."""
    sides = [drawn("left", [-0.123456789, 0.0]), drawn("right", [0.123456789012, 0.0])]
    sides += [drawn(part, [0.0, 0.0]) for part in ("bottom", "top")]
    strip = {"geometry": rectangle([0.0, 0.0], [2.0, 1.0]), "material": elastic(1.0, 0.3)}
    solution = solve(problem(**strip, mesh={"element_size": 0.25}, boundary=sides))
    assert solution.converged, solution.reason
