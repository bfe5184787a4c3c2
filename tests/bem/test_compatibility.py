"""Data that contradict each other where parts meet are refused; data that do not are not."""

from __future__ import annotations

import pytest
from shapes import closing, drawn, elastic, moved, problem, rectangle

from petcontact import Circle, InputError, SideBySide, adapt, solve
from petcontact.bem.compatibility import check_compatible


def posed(left, geometry=None, **contact):
    return problem(
        material=elastic(100.0, 0.3),
        geometry=geometry or rectangle((0, 0), (4, 2)),
        mesh={"element_size": 0.5},
        boundary=[
            closing("bottom", friction_bound=1.0, **contact),
            moved("left", left),
            drawn("right", (0, 0)),
            drawn("top", (0, -1)),
        ],
    )


@pytest.mark.parametrize(
    "value", [(0.1, -0.1), ("free", 0.01), (0, "1e-5*(1 + y)"), (0, "cos(x + y)"), (0, "ny - nx")]
)
@pytest.mark.parametrize("run", [solve, lambda case: adapt(case, 1e-2)], ids=["solve", "adapt"])
def test_a_displacement_into_the_contact_is_refused_in_one_line(run, value):
    with pytest.raises(
        InputError, match=r"^boundary\[1\] \(left\)\.value: has u·n = \S+ at \(0, 0\), .* 'bottom'"
    ) as error:
        run(posed(value))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("value", "more"),
    [
        *(
            (value, {})
            for value in ((0, 0), (0.1, "free"), (0.1, "y"), ("1/y", "y"), (0, "y/(y+x)"))
        ),
        ((0, 0.1), {"normal": "unilateral"}),
        ((0, 0.1), {"normal": "bilateral", "gap": 0.1}),
    ],
)
def test_what_is_compatible_or_cannot_be_known_is_taken(value, more):
    """Only contact without a gap that holds both ways counts."""
    given = posed(value, **more)
    check_compatible(given.geometry.outline(), given.bodies[0])


@pytest.mark.parametrize(
    ("value", "fits"),
    [(("x", "y"), False), (("-y", "x"), True), ((0.1, 0), False), ((0, 0.1), True)],
)
def test_arcs_have_the_normal_of_their_ends(value, fits):
    """A circle in contact on one half: at its ends, (1, 0) and (-1, 0), the normal is ±x."""
    halves = [
        {"part": "bottom", "to": (1, 0), "through": (0, -1)},
        {"part": "left", "to": (-1, 0), "through": (0, 1)},
    ]
    ring = Circle(part="hole", center=(0, 0), radius=0.5)
    given = posed(value, SideBySide(loops=(halves, ring)))
    if fits:
        check_compatible(given.geometry.outline(), given.bodies[0])
    else:
        with pytest.raises(InputError, match=r"has u·n = "):
            check_compatible(given.geometry.outline(), given.bodies[0])
