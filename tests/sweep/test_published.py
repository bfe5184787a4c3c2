"""The counts of the paper's tables, and which cases they belong to."""

from __future__ import annotations

import pytest
from examples import example

from petcontact import Contact, Material, MeshOptions, Rectangle
from petcontact.sweep.published import example_number, published_count, published_counts


def test_published_means_are_those_of_the_tables():
    counts = published_counts()
    assert len(counts) == 128

    def mean(number, rule):
        some = [
            count
            for (example, name, *_), count in counts.items()
            if (example, name) == (number, rule)
        ]
        return round(sum(some) / len(some), 1), len(some)

    assert mean(1, "self-adaptive") == (69.5, 32)
    assert mean(1, "modified") == (51.8, 32)
    assert mean(2, "self-adaptive") == (59.2, 32)
    assert mean(2, "modified") == (45.8, 32)


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


@pytest.mark.parametrize(
    "change",
    [
        {"material": Material(young_modulus=10_000.0, poisson_ratio=0.3, plane="stress")},
        {"geometry": Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0, 4.1))},
    ],
)
def test_another_problem_is_not_the_papers(change):
    case = example(1)
    assert example_number(case) == 1
    assert example_number(case.model_copy(update=change)) is None


def test_other_boundary_conditions_are_not_the_papers():
    case = example(2)
    without_load = tuple(b for b in case.boundary if b.part != "right")
    assert example_number(case.model_copy(update={"boundary": without_load})) is None
    slippery = (Contact(part="bottom", friction_bound=449.0), *case.boundary[1:])
    assert example_number(case.model_copy(update={"boundary": slippery})) is None
    # an edge that carries no traction may be left out
    case = example(1)
    free = tuple(b for b in case.boundary if b.part != "right")
    assert example_number(case.model_copy(update={"boundary": free})) == 1
