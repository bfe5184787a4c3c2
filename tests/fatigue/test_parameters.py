"""Fatigue parameters against closed forms: uniaxial cycles, torsion, turning axes, mean stress; no
axes are preferred."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from petcontact import InputError, Material
from petcontact.fatigue.evaluate import cycles_to_failure
from petcontact.fatigue.parameters import (
    crossland,
    dang_van,
    findley,
    smith_watson_topper,
)

E, NU, K = 200.0, 0.3, 0.4
STEEL = Material(E, NU), K
X, Y, Z = np.eye(3)


def history(*tensors):
    """One point."""
    return np.array(tensors, dtype=float)[:, None]


def along(axis, values):
    return history(*(value * np.outer(axis, axis) for value in values))


def turned(angle, stress):
    """Stress after a turn about a random axis."""
    rng = np.random.default_rng(angle)
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q, np.einsum("ai,knij,bj->knab", q, stress, q)


def test_cycles_that_press_on_every_plane_open_none():
    stress = history(-1.0 * np.eye(3), -2.0 * np.eye(3))
    assert smith_watson_topper(stress, *STEEL)[0][0] == 0.0


@settings(max_examples=4, deadline=None)
@given(mean=st.floats(-3.0, 3.0), amplitude=st.floats(0.1, 3.0), seed=st.integers(0, 10**6))
def test_uniaxial_cycles_with_a_mean(mean, amplitude, seed):
    q, stress = turned(seed, along(X, (mean - amplitude, mean + amplitude)))
    top = mean + amplitude
    opening = smith_watson_topper(stress, *STEEL)
    if top > 0.0:
        # across the stress its amplitude is that of Poisson's effect, and nothing pulls there
        assert opening[0][0] == pytest.approx(top * amplitude / E, rel=1e-8)
        assert abs(opening[1][0] @ q[:, 0]) == pytest.approx(1.0, abs=1e-6)
    else:
        assert opening[0][0] == pytest.approx(0.0, abs=1e-12)
    # max over θ of σ_a/2 sin 2θ + k max(σ cos² θ): with σ_max > 0 an angle in closed form, else
    # planes without normal stress
    if top > 0.0:
        wanted = 0.5 * (np.hypot(amplitude, K * top) + K * top)
        assert findley(stress, *STEEL)[0][0] == pytest.approx(wanted, rel=1e-7)
    assert crossland(stress, *STEEL)[0][0] == pytest.approx(
        amplitude / np.sqrt(3.0) + K * top / 3.0, rel=1e-9
    )
    # the deviator less its middle is that of ± σ_a
    assert dang_van(stress, *STEEL)[0][0] == pytest.approx(
        0.5 * amplitude + K * top / 3.0, rel=1e-9
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_torsion(seed):
    shear = 2.0 * (np.outer(X, Y) + np.outer(Y, X))
    _, stress = turned(seed, history(shear, -shear))
    assert findley(stress, *STEEL)[0][0] == pytest.approx(2.0 * np.sqrt(1.0 + K**2), rel=1e-7)
    assert crossland(stress, *STEEL)[0][0] == pytest.approx(2.0)
    assert dang_van(stress, *STEEL)[0][0] == pytest.approx(2.0)
    assert smith_watson_topper(stress, *STEEL)[0][0] == pytest.approx(
        2.0 * 2.0 * (1.0 + NU) / E, rel=1e-8
    )


@pytest.mark.parametrize("moments", [4, 9, 24])
def test_principal_axes_that_turn(moments):
    """A deviator of constant size turns in the plane: a circle in the space of deviators, its
    radius the amplitude."""
    angle = 2.0 * np.pi * np.arange(moments) / moments
    stress = history(
        *(
            np.cos(a) * (np.outer(X, X) - np.outer(Y, Y))
            + np.sin(a) * (np.outer(X, Y) + np.outer(Y, X))
            for a in angle
        )
    )
    assert crossland(stress, *STEEL)[0][0] == pytest.approx(1.0, rel=1e-6)
    assert dang_van(stress, *STEEL)[0][0] == pytest.approx(1.0, rel=1e-6)
    # every plane through z sees both shear and normal stress of ±1 at some time, those nearest to
    # the moments most
    assert findley(stress, *STEEL)[0][0] == pytest.approx(
        1.0 + K, rel=0.03 if moments < 24 else 1e-2
    )
    # on a plane the normal stress is cos, its strain (1+ν)/E of it
    opening = smith_watson_topper(stress, *STEEL)[0][0]
    assert opening == pytest.approx((1.0 + NU) / E, rel=1e-7 if moments % 2 == 0 else 0.04)


def test_out_of_phase_tension_and_torsion():
    """σ = cos ωt, τ = r sin ωt: √J2 runs on an ellipse with the half axes 1/√3 and r."""
    angle = 2.0 * np.pi * np.arange(40) / 40
    for r in (0.3, 0.8):
        stress = history(
            *(
                np.cos(a) * np.outer(X, X) + r * np.sin(a) * (np.outer(X, Y) + np.outer(Y, X))
                for a in angle
            )
        )
        wanted = max(1.0 / np.sqrt(3.0), r) + K / 3.0
        assert crossland(stress, *STEEL)[0][0] == pytest.approx(wanted, rel=1e-9)


def test_cycles_to_failure():
    constants = (900.0, -0.09, 0.3, -0.6)
    for cycles in (1e2, 1e5, 1e8):
        value = 900.0**2 / 200e3 * (2.0 * cycles) ** -0.18 + 900.0 * 0.3 * (2.0 * cycles) ** -0.69
        assert cycles_to_failure(value, 200e3, constants) == pytest.approx(cycles, rel=1e-9)
    assert cycles_to_failure(0.0, 200e3, constants) == np.inf
    with pytest.raises(InputError, match="negative"):
        cycles_to_failure(1.0, 200e3, (900.0, 0.09, 0.3, -0.6))
