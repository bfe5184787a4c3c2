"""Projection, residual and norm: Lemma 2.1 and the properties of a projection."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from petcontact.contact.friction_law import contact_norm, group_norms, project_ball, ratio
from petcontact.contact.law_protocol import law_residual
from petcontact.contact.laws import Tresca

# squares of numbers below 1e-60 underflow in any norm
sizes = st.one_of(st.just(0.0), st.floats(1e-60, 1e6))
finite = st.builds(lambda size, sign: size * sign, sizes, st.sampled_from([-1.0, 1.0]))


@st.composite
def vectors(draw, count=2):
    shape = (draw(st.integers(1, 8)), draw(st.integers(1, 2)))
    radius = draw(arrays(float, shape[0], elements=sizes))
    return (*(draw(arrays(float, shape, elements=finite)) for _ in range(count)), radius)


@given(vectors())
def test_projection_is_firmly_nonexpansive_and_idempotent(data):
    x, y, radius = data
    px, py = project_ball(x, radius), project_ball(y, radius)
    assert np.all(np.linalg.norm(px, axis=1) <= radius * (1 + 1e-12))
    assert np.allclose(project_ball(px, radius), px, rtol=1e-12, atol=0)
    inner = np.sum((px - py) * (x - y), axis=1)
    slack = 1e-9 * (1.0 + np.sum(x * x + y * y, axis=1))
    assert np.all(np.sum((px - py) ** 2, axis=1) <= inner + slack)


@given(vectors(1), st.floats(1e-3, 1e6))
def test_lemma_2_1_friction_condition_gives_zero_residual(data, rho):
    x, bound = data
    size = np.linalg.norm(x, axis=1, keepdims=True)
    slips = size[:, 0] > 0.0
    # slip: σ_t = -g u/|u|; stick: u = 0 with any |σ_t| <= g
    direction = np.divide(x, size, out=np.zeros_like(x), where=size > 0)
    residual = law_residual(Tresca(bound), x, -bound[:, None] * direction, rho)
    assert np.abs(residual[slips]).max(initial=0.0) <= 1e-9 * (1.0 + bound.max())
    sigma = project_ball(x, bound)
    assert np.abs(law_residual(Tresca(bound), np.zeros_like(x), sigma, rho)).max() <= 1e-9 * (
        1.0 + bound.max()
    )


@pytest.mark.parametrize("rho", [0.0, -1.0, np.nan])
def test_residual_refuses_rho(rho):
    with pytest.raises(ValueError, match="positive"):
        law_residual(Tresca(np.ones(2)), np.zeros((2, 1)), np.zeros((2, 1)), rho)


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="shape"):
        law_residual(Tresca(np.ones(2)), np.zeros((2, 1)), np.zeros((3, 1)), 1.0)
    with pytest.raises(ValueError, match="radii"):
        project_ball(np.zeros(3), np.ones(3))
    with pytest.raises(ValueError, match="negative"):
        project_ball(np.zeros((1, 1)), -np.ones(1))


def test_norm_and_balance():
    weight = np.array([0.5, 1.5])
    u, sigma = np.array([[2.0], [0.0]]), np.array([[-6.0], [1.0]])
    assert contact_norm(u, weight) == pytest.approx(np.sqrt(2.0))
    (moved, _), (traction, _), (none, _) = group_norms(weight, (slice(0, 1),), u, sigma, 0 * u)
    assert moved == pytest.approx(np.sqrt(2.0)) and none == 0.0
    assert ratio(moved, traction, 7.0) == pytest.approx(np.sqrt((18.0 + 1.5) / 2.0))
    assert ratio(none, traction, 7.0) == 7.0
    assert Tresca(np.array([6.0, 6.0])).states(3.0 * u - sigma).tolist() == [1, 0]


def test_norms_neither_overflow_nor_underflow():
    weight, groups = np.array([0.5, 1.5]), (slice(0, 1), slice(1, 2))
    x = np.array([[3.0, 0.0], [4.0, 0.0]])
    expected = np.sqrt(0.5 * 9.0 + 1.5 * 16.0)
    for scale in (1e-200, 1.0, 1e200):
        (found,) = group_norms(weight, groups, scale * x)
        np.testing.assert_allclose(found, [scale * expected, scale * expected, 0.0], rtol=1e-14)
    assert np.isnan(group_norms(weight, groups, np.nan * x)[0]).all()
    assert group_norms(weight, groups[:1], np.inf * x[:, :1]) == [[np.inf, np.inf]]
