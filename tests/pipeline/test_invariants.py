"""Lemma 3.2 and condition (3.4) of the paper, checked in every iteration.

(3.5) holds exactly in the discrete inner product, the sum over nodes with their weights: projection
works node by node, and the Robin step keeps σ + ρu = f exactly. Only (3.6), which makes the last
term of (3.5) a decrease, needs the symmetric part of the weighted S to be positive; that is checked
by itself.
"""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
from examples import example

from petcontact import MeshOptions, Method
from petcontact.contact.criterion import Criterion
from petcontact.contact.friction_law import contact_norm
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.registry import method_of
from petcontact.pipeline.run import prepare
from petcontact.pipeline.steps.step_loop import first_increment

pytestmark = pytest.mark.usefixtures("unestimated")

RULES = ("fixed", "self-adaptive", "modified", "modified-safeguarded")
ROUND_OFF = 1e-11


def iterate(prepared, method, rule=None, monitor=None):
    """The outcome of a method on the contact system of a prepared problem."""
    iteration = Iteration(
        Criterion(method.tolerance, method.stop), method.max_iterations, None, monitor
    )
    return method_of(method, rule)(
        first_increment(prepared).system, prepared.discrete.law, iteration
    )


def iterates(prepared, rule, rho, omega=1.8):
    """(u, σ, ρ of the step that led there) of every iteration, from the zero start."""
    zero = np.zeros((prepared.system.size, prepared.system.k))
    result = [(zero, zero, rho)]
    method = Method(rule=rule, rho=rho, omega=omega, tolerance=1e-8, max_iterations=300)
    iterate(prepared, method, monitor=lambda s: result.append((s.v, s.sigma, s.rho)))
    return result


@functools.cache
def solved(number, order):
    """An example, prepared, and what Newton's method finds."""
    prepared = prepare(example(number, mesh=MeshOptions(element_size=0.4, order=order)))
    return prepared, iterate(prepared, Method(name="semismooth-newton"))


@pytest.mark.parametrize(("number", "order"), [(1, 0), (2, 2)])
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("rho, omega", [(1.0, 1.8), (1e6, 1.95)])
def test_3_5_in_every_iteration(number, order, rule, rho, omega):
    prepared, exact = solved(number, order)
    weight = prepared.system.weight
    path = iterates(prepared, rule, rho, omega)
    assert len(path) > 10
    for (u, sigma, _), (new_u, new_sigma, rho_k) in itertools.pairwise(path):
        before = contact_norm(sigma - exact.sigma + rho_k * (u - exact.v), weight) ** 2
        after = contact_norm(new_sigma - exact.sigma + rho_k * (new_u - exact.v), weight) ** 2
        work = float(weight @ ((sigma - exact.sigma) * (u - exact.v))[:, 0])
        size = contact_norm(exact.sigma, weight) ** 2 + (rho_k * contact_norm(exact.v, weight)) ** 2
        assert after <= before - 2.0 * omega * rho_k * work + ROUND_OFF * size


@pytest.mark.parametrize(
    ("number", "mesh"),
    [(1, MeshOptions(element_size=0.1)), (2, MeshOptions(order=3, levels=8))],
    ids=["constant", "graded"],
)
def test_3_6_the_weighted_s_is_positive(number, mesh, comm):
    prepared = prepare(example(number, mesh=mesh), comm)
    weight = prepared.system.weight
    form = weight[:, None] * first_increment(prepared).system.compliance()
    prepared.close()
    # scaled to a unit diagonal, so that the smallest elements of a graded mesh count as much as the
    # largest
    scale = 1.0 / np.sqrt(np.diag(form))
    symmetric = 0.5 * (form + form.T) * scale[:, None] * scale
    skew = 0.5 * (form - form.T) * scale[:, None] * scale
    assert np.linalg.eigvalsh(symmetric).min() > 1e-6
    # S is self-adjoint only up to the collocation error
    assert 1e-6 < np.linalg.norm(skew, 2) / np.linalg.norm(symmetric, 2) < 0.05
