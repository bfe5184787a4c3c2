"""Lamé's cylinder and Kirsch's plate: displacement and traction on Γ, displacement and stress
inside, rates as measured.

Run as a program it prints the table of the manual.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # where it runs as a program

from shapes import closing, drawn, elastic, moved, outline, problem
from smooth_field import STEEL, kolosov, pull

from petcontact import solve
from petcontact.fields.interior import field_at
from petcontact.reference.lame import Cylinder

pytestmark = pytest.mark.usefixtures("unestimated")

TUBE = Cylinder(1.0, 2.0, 200.0, 0.3, pressure_inside=1.0)
METHOD = {"name": "projection", "rule": "modified", "rho": 100.0}
METHOD |= {"tolerance": 1e-10, "max_iterations": 5000}


class Lame:
    """Quarter of a cylinder, 1 <= r <= 2, between two frictionless contact sides, under inner
    pressure 1."""

    body = outline(bottom=[2, 0], outer=[0, 2, 2.0], left=[0, 1], inner=[1, 0, -1.0])
    boundary = (
        closing("bottom", friction_bound=0.0),
        closing("left", friction_bound=0.0),
        drawn("outer", [0, 0]),
        {"part": "inner", "condition": "traction", "pressure": 1.0},
    )

    @staticmethod
    def exact(x):
        """Displacement and stress: φ = c z, ψ = d/z."""
        z, one = x[:, 0] + 1j * x[:, 1], np.ones(len(x), dtype=complex)
        along, around = (stress[0] for stress in TUBE.stress(np.array([1.0])))
        c, d = 0.25 * (along + around), 0.5 * (along - around)
        return kolosov(z, (c * z, c * one, 0.0 * one), (d / z, -d / z**2))

    @staticmethod
    def points(rng):
        r, angle = rng.uniform(1.02, 1.98, 40), rng.uniform(0.02, 0.5 * np.pi - 0.02, 40)
        return np.column_stack([r * np.cos(angle), r * np.sin(angle)])


def kirsch(x):
    """Of a plate with a hole of radius 1 under tension 1 along x."""
    z = x[:, 0] + 1j * x[:, 1]
    phi = 0.25 * (z + 2.0 / z), 0.25 * (1.0 - 2.0 / z**2), 1.0 / z**3
    psi = 0.5 * (1.0 / z**3 - 1.0 / z - z), 0.5 * (1.0 / z**2 - 1.0 - 3.0 / z**4)
    return kolosov(z, phi, psi)


def given(field, *components):
    """Displacements (0) or stresses (1) of Kirsch's field as functions of x and y."""

    def component(k):
        return lambda x, y: kirsch(np.column_stack([x, y]))[field][:, k]

    return tuple(component(k) for k in components)


class Kirsch:
    """Upper half of a plate with a hole of radius 1 under tension 1 along x: outer sides carry the
    exact data of the infinite plate, and the two stretches of the line of symmetry are frictionless
    contact sides."""

    body = outline(
        **{"right foot": [3, 0], "right": [3, 2], "top": [-3, 2]},
        **{"left": [-3, 0], "left foot": [-1, 0]},
    )
    body["loops"][0].insert(0, {"part": "hole", "to": [1, 0], "through": [0, 1]})
    boundary = (
        closing("right foot", friction_bound=0.0),
        closing("left foot", friction_bound=0.0),
        drawn("hole", [0, 0]),
        drawn("right", given(1, 0, 2)),
        drawn("top", given(1, 2, 1)),
        moved("left", given(0, 0, 1)),
    )

    exact = staticmethod(kirsch)

    @staticmethod
    def points(rng):
        p = np.column_stack([rng.uniform(-2.95, 2.95, 80), rng.uniform(0.05, 1.95, 80)])
        return p[np.hypot(*p.T) > 1.05]


def posed(case, **mesh):
    """The problem of one of these, by `METHOD`."""
    more = {"geometry": case.body, "boundary": list(case.boundary), "mesh": mesh}
    return problem(material=elastic(200.0, 0.3), method=METHOD, **more)


def measure(case, **mesh):
    """Relative errors: u and traction in L2(Γ), u and stress at points inside (largest)."""
    solution = solve(posed(case, **mesh))
    assert solution.converged
    m = solution.mesh
    exact_u, stress = case.exact(m.x)
    exact_t = pull(stress, m.normal)
    norm = lambda values: np.sqrt(m.weight @ np.sum(values**2, axis=1))  # noqa: E731
    points = case.points(np.random.default_rng(1))
    u, s = field_at(m, solution.u, solution.traction, STEEL, points)
    inside_u, inside_s = case.exact(points)
    return np.array(
        [
            norm(solution.u - exact_u) / norm(exact_u),
            norm(solution.traction - exact_t) / norm(exact_t),
            np.abs(u - inside_u).max() / np.abs(inside_u).max(),
            np.abs(s - inside_s).max() / np.abs(inside_s).max(),
        ]
    )


@pytest.mark.parametrize(
    ("case", "order", "sizes", "rates", "last"),
    [
        # order of u on Γ, of the traction on Γ, of u inside, of the stress inside; relative errors
        # on the finest mesh
        (Lame, 0, (0.2, 0.1), (0.9, 0.4, 0.9, 1.1), (6.8e-3, 6.0e-3, 6.0e-3, 6.0e-3)),
        (Lame, 2, (0.8, 0.4), (3.5, 1.9, 3.5, 2.8), (8e-5, 1.3e-3, 1.3e-4, 1.3e-3)),
        (Kirsch, 3, (0.4, 0.2), (3.5, 2.0, 3.5, 4.5), (5e-7, 1.3e-4, 5e-7, 8e-7)),
    ],
    ids=lambda value: (
        value.__name__
        if isinstance(value, type)
        else (str(value) if isinstance(value, int) else "")
    ),
)
def test_errors_and_rates(case, order, sizes, rates, last):
    errors = [measure(case, element_size=h, order=order) for h in sizes]
    assert np.all(errors[-1] <= last), errors[-1]
    for coarse, fine in itertools.pairwise(errors):
        assert np.all(np.log2(coarse / fine) >= rates), np.log2(coarse / fine)


def test_graded_meshes_of_high_order_reach_eight_digits():
    assert np.all(measure(Lame, order=5, levels=3) < (4e-9, 1e-6, 8e-9, 3e-7))


def print_table():
    """Errors on refined meshes, and in brackets the orders of convergence."""
    print("| problem | order | h | u on Γ | traction on Γ | u inside | stress inside |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for case, order, sizes in (
        (Lame, 0, (0.2, 0.1, 0.05)),
        (Lame, 3, (0.8, 0.4, 0.2)),
        (Kirsch, 0, (0.2, 0.1, 0.05)),
        (Kirsch, 3, (0.8, 0.4, 0.2)),
    ):
        before = None
        for h in sizes:
            errors = measure(case, element_size=h, order=order)
            rates = (
                [""] * 4
                if before is None
                else [f" ({rate:.1f})" for rate in np.log2(before / errors)]
            )
            cells = [f"{error:.1e}{rate}" for error, rate in zip(errors, rates, strict=True)]
            print(f"| {case.__name__} | {order} | {h:g} | {' | '.join(cells)} |")
            before = errors


if __name__ == "__main__":
    print_table()
