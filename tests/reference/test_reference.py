"""The closed forms against what they must satisfy: equilibrium, resultants, Hooke's law, limits;
and their own examples."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import numpy as np
import pytest
from scipy.integrate import quad

import petcontact.reference
from petcontact.reference.cattaneo_mindlin import LinePartialSlip, PointPartialSlip
from petcontact.reference.half_plane import elliptic_load
from petcontact.reference.hertz import LineContact, PointContact
from petcontact.reference.lame import Cylinder, RotatingDisc, Sphere
from petcontact.reference.persson import pressure
from petcontact.reference.spence import stick_ratio_in_the_plane, stick_ratio_of_a_circle
from petcontact.reference.westergaard import WavyContact

MODULES = [module.name for module in pkgutil.iter_modules(petcontact.reference.__path__)]
LINE, POINT = LineContact(0.7, 2.5, 1.3), PointContact(0.7, 2.5, 1.3)


def at(function, x):
    return float(function(np.array([x]))[0])


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    module = importlib.import_module(f"petcontact.reference.{name}")
    result = doctest.testmod(module, extraglobs={"np": np})
    assert result.attempted > 0 and result.failed == 0


@pytest.mark.parametrize("share", [0.1, 0.64, 0.99])
def test_partial_slip_carries_the_force(share):
    mu = 0.4
    line = LinePartialSlip(LINE, mu, share * mu * LINE.load)
    point = PointPartialSlip(POINT, mu, share * mu * POINT.load)
    a, c, r = LINE.half_width, line.stick_half_width, POINT.contact_radius
    found = 2.0 * quad(lambda x: at(line.traction, x), 0.0, a, points=[c])[0]
    assert found == pytest.approx(line.force, rel=1e-7)
    found = quad(
        lambda s: 2.0 * np.pi * s * at(point.traction, s), 0.0, r, points=[point.stick_radius]
    )[0]
    assert found == pytest.approx(point.force, rel=1e-7)
    x = np.linspace(0.0, a, 101)
    q, limit = line.traction(x), mu * LINE.pressure(x)
    assert np.all(q <= limit * (1.0 + 1e-12)) and np.allclose(q[x > c], limit[x > c])
    assert np.all(line.slip(x[x <= c]) == 0.0)
    # the slope of slip is the difference of the surface strains, 2/(πE*) PV∫ q(s)/(x-s) ds
    x = 0.5 * (a + c)
    pull = quad(lambda s: at(line.traction, s), -a, a, weight="cauchy", wvar=x, epsrel=1e-6)[0]
    slope = (at(line.slip, x + 1e-5) - at(line.slip, x - 1e-5)) / 2e-5
    assert slope == pytest.approx(2.0 / (np.pi * LINE.modulus) * abs(pull), rel=1e-4)


@pytest.mark.parametrize("degrees", [20.0, 84.0])
def test_a_pin_in_a_hole_carries_the_force(degrees):
    angle = np.radians(degrees)
    force = quad(lambda phi: at(lambda t: pressure(t, angle), phi) * np.cos(phi), -angle, angle)[0]
    assert force == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("share", [0.05, 0.5, 0.99, 1.0, 2.0])
def test_waves(share):
    wave = WavyContact(share * np.pi * 1.3 * 0.01 / 2.0, 0.01, 2.0, 1.3)
    mean = (
        quad(lambda x: at(wave.pressure, x), -1.0, 1.0, points=[-wave.half_width, wave.half_width])[
            0
        ]
        / 2.0
    )
    assert mean == pytest.approx(wave.pressure_far, rel=1e-6)
    if share < 0.1:  # as a cylinder of the crest's radius
        crest = LineContact(wave.pressure_far * 2.0, 1.0 / (0.01 * np.pi**2), 1.3)
        assert wave.half_width == pytest.approx(crest.half_width, rel=0.01)


def test_stick_ratios_have_the_right_limits():
    """Values of Spence's uncoupled forms; all sticks with much friction, nothing with none."""
    assert stick_ratio_in_the_plane(0.1, 0.2857) == pytest.approx(0.044960, abs=1e-6)
    for ratio in (stick_ratio_in_the_plane, stick_ratio_of_a_circle):
        assert ratio(0.9, 0.2) > 0.999 and ratio(0.02, 0.2) < 0.01
        assert (ratio(0.0, 0.2), ratio(1e3, 0.2)) == (0.0, 1.0)


@pytest.mark.parametrize(
    "body",
    [
        Cylinder(1.0, 2.5, 3.0, 0.3, 1.0, 0.4),
        Cylinder(1.0, 2.5, 3.0, 0.3, 1.0, 0.4, plane="stress"),
        Sphere(1.0, 2.5, 3.0, 0.3, 1.0, 0.4),
        RotatingDisc(0.5, 2.0, 3.0, 0.3, 1.7, 2.0),
        RotatingDisc(0.5, 2.0, 3.0, 0.3, 1.7, 2.0, plane="strain"),
    ],
)
def test_equilibrium_and_hookes_law(body):
    """dσ_r/dr + k(σ_r - σ_θ)/r + ρω²r = 0, and the strains du/dr, u/r are those of the stress."""
    r, h = np.linspace(1.1, 1.9, 9), 1e-5
    k = 2.0 if isinstance(body, Sphere) else 1.0
    force = getattr(body, "density", 0.0) * getattr(body, "speed", 0.0) ** 2 * r
    (sr, st), slope = body.stress(r), (body.stress(r + h)[0] - body.stress(r - h)[0]) / (2.0 * h)
    assert np.allclose(slope + k * (sr - st) / r + force, 0.0, atol=1e-7)
    strain_r = (body.displacement(r + h) - body.displacement(r - h)) / (2.0 * h)
    strain_t = body.displacement(r) / r
    nu, young = body.poisson, body.young
    third = st if isinstance(body, Sphere) else nu * (sr + st) if body.plane == "strain" else 0.0
    assert np.allclose(strain_t, (st - nu * (sr + third)) / young, atol=1e-9)
    assert np.allclose(strain_r, (sr - nu * (st + third)) / young, atol=1e-8)


def test_pressures_carry_the_load():
    a, r = LINE.half_width, POINT.contact_radius
    assert quad(lambda x: at(LINE.pressure, x), -a, a)[0] == pytest.approx(LINE.load, rel=1e-7)
    assert quad(lambda s: 2.0 * np.pi * s * at(POINT.pressure, s), 0.0, r)[0] == pytest.approx(
        POINT.load, rel=1e-7
    )
    assert at(LINE.pressure, 1.01 * a) == at(POINT.pressure, 1.01 * r) == 0.0


def test_half_plane_is_in_equilibrium():
    """div σ = 0 and Hooke's law inside, by differences."""
    x, h, nu, load = np.array([[0.3, -0.4], [-1.2, -0.7]]), 1e-4, 0.3, 1.0 + 0.4j
    ahead = [
        (elliptic_load(x + h * e, load, 1.0, nu), elliptic_load(x - h * e, load, 1.0, nu))
        for e in np.eye(2)
    ]
    d = [[(p - m) / (2.0 * h) for p, m in zip(*pair, strict=True)] for pair in ahead]
    assert np.allclose(d[0][1] + d[1][3], 0.0, atol=1e-6)
    assert np.allclose(d[0][3] + d[1][2], 0.0, atol=1e-6)
    _, xx, yy, xy = elliptic_load(x, load, 1.0, nu)
    assert np.allclose(d[0][0].real, xx - nu * (xx + yy), atol=1e-6)
    assert np.allclose(d[1][0].imag, yy - nu * (xx + yy), atol=1e-6)
    assert np.allclose(0.5 * (d[1][0].real + d[0][0].imag), xy, atol=1e-6)
