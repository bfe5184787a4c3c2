"""The counts of the paper's tables, and which cases they belong to."""

from __future__ import annotations

import pytest
from examples import example

from petcontact import Contact, Material, MeshOptions, Rectangle
from petcontact.sweep.published import example_number, published_count


@pytest.mark.parametrize(
    ("number", "rule", "rho", "h", "count"),
    [(1, "modified", 1.0, 0.05, 62), (2, "self-adaptive", 1e7, 0.2, 65)],
)
def test_a_case_is_known_by_what_it_is(number, rule, rho, h, count):
    case = example(number, mesh=MeshOptions(element_size=h, order=0), rule=rule, rho=rho, omega=0.9)
    assert published_count(case) == count
    order, size, fixed = (
        {"mesh": MeshOptions(element_size=h, order=1)},
        {"mesh": MeshOptions(element_size=0.3, order=0)},
        {"method": case.method.model_copy(update={"rule": "fixed"})},
    )
    for change in (order, size, fixed):
        assert published_count(case.model_copy(update=change)) is None


def test_another_problem_is_not_the_papers():
    first, second = example(1), example(2)
    stress = Material(young_modulus=10_000.0, poisson_ratio=0.3, plane="stress")
    without_load = tuple(b for b in second.boundary if b.part != "right")
    slippery = (Contact(part="bottom", friction_bound=449.0), *second.boundary[1:])
    for case, change in (
        (first, {"material": stress}),
        (first, {"geometry": Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0, 4.1))}),
        (second, {"boundary": without_load}),
        (second, {"boundary": slippery}),
    ):
        assert example_number(case.model_copy(update=change)) is None
    # an edge that carries no traction may be left out
    free = tuple(b for b in first.boundary if b.part != "right")
    assert example_number(first.model_copy(update={"boundary": free})) == 1
