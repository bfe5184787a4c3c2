"""Exponents of corners and joints against published figures and closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from petcontact.refinement.corner_exponents import (
    CLAMPED,
    FREE,
    SLIDING,
    corner_exponent,
    exponents,
    joint,
    least_exponent,
    wedge,
)

KAPPA = 3.0 - 4.0 * 0.3


@pytest.mark.parametrize(
    ("degrees", "first", "second", "expected"),
    [
        (270, FREE, FREE, 0.5445),
        (360, FREE, FREE, 0.5),  # Williams (1952): notch, crack
        (90, CLAMPED, FREE, 0.7112),
        (180, CLAMPED, FREE, 0.5),  # a punch that sticks (the real part, 1/2)
        (270, CLAMPED, CLAMPED, 0.5951),
        (141, SLIDING, FREE, 0.53),
        (180, SLIDING, FREE, 0.5),
        (180, CLAMPED, SLIDING, 0.5),
        (135, SLIDING, SLIDING, 1.0 / 3.0),
        (90, SLIDING, SLIDING, 1.0),
        (90, FREE, FREE, 1.0),
        (180, SLIDING, SLIDING, 1.0),
    ],
)
def test_known_exponents(degrees, first, second, expected):
    for pair in ((first, second), (second, first)):
        assert corner_exponent(math.radians(degrees), KAPPA, *pair) == pytest.approx(
            expected, abs=3e-3
        )


@pytest.mark.parametrize("degrees", [225, 270, 330])
def test_both_exponents_of_a_notch(degrees):
    """sin λω = ∓λ sin ω, opened and sheared: M. L. Williams (1952)."""
    angle = math.radians(degrees)
    expected = [
        brentq(
            lambda power, way=way: math.sin(power * angle) + way * power * math.sin(angle), *ends
        )
        for way, ends in ((1.0, (0.4, 0.9)), (-1.0, (0.51, 0.99)))
        if math.sin(ends[1] * angle) + way * ends[1] * math.sin(angle) < 0.0
    ]
    found = [root.real for root in exponents(wedge(angle, KAPPA, FREE, FREE), 0.1, 0.99)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("degrees", [70, 90, 150, 250, 355])
def test_exponents_do_not_depend_on_round_off(degrees):
    """Clamped and free, all of 4κ sin² λω = (κ + 1)² - 4λ² sin² ω: M. L. Williams (1952)."""
    angle, random = math.radians(degrees), np.random.default_rng(3)
    exact = wedge(angle, KAPPA, CLAMPED, FREE)

    def rounded(power):
        matrix = exact(power)
        return matrix * (1.0 + 4.0 * np.finfo(float).eps * random.standard_normal(matrix.shape))

    found = np.array(exponents(exact, 1e-4, 3.3))
    np.testing.assert_allclose(exponents(rounded, 1e-4, 3.3), found, atol=1e-9)
    left = 4.0 * KAPPA * np.sin(found * angle) ** 2
    right = (KAPPA + 1.0) ** 2 - 4.0 * (found * math.sin(angle)) ** 2
    np.testing.assert_allclose(left, right, rtol=1e-7)
    assert len(found) >= int(3.3 * angle / math.pi)


@pytest.mark.parametrize(("first", "kind"), [(FREE, 0.6), (CLAMPED, 0.9), (0.4, -0.7)])
def test_skew_rollers_against_complex_potentials(first, kind):
    """φ = A z^λ, ψ = B z^λ: 2µu = κφ - z φ̄' - ψ̄, and tractions along a ray are -i times the slope
    of φ + z φ̄' + ψ̄."""
    angle = 2.2

    def determinant(power):
        rows = []
        for theta, side in ((0.0, first), (angle, kind)):
            outwards = np.exp(1j * theta)
            columns = []
            for a, b in ((1.0, 0.0), (1.0j, 0.0), (0.0, 1.0), (0.0, 1.0j)):
                phi, psi = a * outwards**power, b * outwards**power
                bent = outwards * power * np.conj(a * outwards ** (power - 1.0))
                columns.append(
                    (KAPPA * phi - bent - np.conj(psi), -1j * (phi + bent + np.conj(psi)))
                )
            moved, force = (np.array(column) for column in zip(*columns, strict=True))
            if side in (FREE, CLAMPED):
                vector = force if side == FREE else moved
                rows += [vector.real, vector.imag]
            else:
                held = outwards * np.exp(1j * float(side))
                rows += [(np.conj(held) * moved).real, (np.conj(1j * held) * force).real]
        return np.linalg.det(np.array(rows))

    grid = np.linspace(0.05, 0.999, 950)
    values = [determinant(power) for power in grid]
    roots = [
        brentq(determinant, a, b)
        for (a, b), (f, g) in zip(itertools.pairwise(grid), itertools.pairwise(values), strict=True)
        if f * g < 0.0
    ]
    found = corner_exponent(angle, KAPPA, first, kind)
    assert found == pytest.approx((roots or [1.0])[0], abs=1e-4)


@pytest.mark.parametrize("friction", [-0.5, 0.0, 0.5])
def test_a_rigid_punch_with_friction_on_a_half_plane(friction):
    """α = 1/2 ∓ arctan(f (1-2ν)/(2(1-ν)))/π: K. L. Johnson, Contact mechanics (1985), ch. 2."""
    power = 0.5 - math.atan(friction * 0.4 / 1.4) / math.pi
    edge = joint((math.pi / 2.0, math.pi), (KAPPA, KAPPA), 1e-6, friction)
    assert 1.0 - least_exponent(edge) == pytest.approx(power, abs=1e-3)


def test_two_wedges_have_their_limits():
    """Alike and stuck a notch of their sum, on what is rigid the wedge alone; a flush joint of the
    same material is none."""
    right = math.pi / 2.0
    stuck, smooth = (
        {
            stiffer: least_exponent(joint((right, math.pi), (KAPPA, KAPPA), stiffer, way))
            for stiffer in (1.0, 1e6)
        }
        for way in (math.inf, 0.0)
    )
    assert stuck[1.0] == pytest.approx(corner_exponent(3.0 * right, KAPPA, FREE, FREE), abs=1e-4)
    assert stuck[1e6] == pytest.approx(corner_exponent(right, KAPPA, CLAMPED, FREE), abs=1e-4)
    assert smooth[1e6] == corner_exponent(right, KAPPA, SLIDING, FREE) == 1.0
    assert smooth[1.0] == pytest.approx(
        0.774, abs=1e-3
    )  # Dundurs and Lee (1972), alike and without friction
    assert least_exponent(joint((right, right), (KAPPA, KAPPA), 1.0, math.inf)) == 1.0


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_block_whose_end_slides_along_a_wall(friction):
    """With its image in the wall it is pressed by r^a on both sides of the corner, the half plane
    on one: 2 cot πa = 1/sin πa, a = λ - 1; normal displacements by equal shears are equal."""
    edge = joint((math.pi / 2.0, math.pi), (KAPPA, KAPPA), 1.0, friction, (SLIDING, FREE))
    assert least_exponent(edge) == pytest.approx(2.0 / 3.0, abs=1e-4)
