"""Newton and the projection on small exact systems: half planes, half spaces, random positive
definite matrices."""

from __future__ import annotations

import numpy as np
import pytest
from half_space import half_plane, half_space, pressed
from reduced_system import ReducedSystem, coulomb

from petcontact import InputError
from petcontact.contact.criterion import Criterion, equilibrium_defect
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.methods.operator_robin import OperatorRobin
from petcontact.contact.methods.projection import Projection
from petcontact.contact.rho_rules import Modified, SelfAdaptive
from petcontact.reference.hertz import PointContact, contact_modulus

NEWTON = SemismoothNewton()


def iteration(tolerance=1e-9, limit=300, start=None, monitor=None):
    return Iteration(Criterion(tolerance), limit, start, monitor)


def satisfies(law, system, state, mu, slack=1e-8):
    """Signorini's and Coulomb's conditions themselves, node by node."""
    v, sigma = state.v, state.sigma
    length, stress = np.abs(system.u_0).max(), np.abs(sigma).max()
    pressure, friction = -sigma[:, -1], np.linalg.norm(sigma[:, :-1], axis=1)
    assert np.all(pressure >= -slack * stress) and np.all(v[:, -1] <= slack * length)
    assert np.abs(pressure * v[:, -1]).max() <= slack * stress * length
    assert np.all(friction <= mu * pressure + slack * stress)
    moved = np.linalg.norm(v[:, :-1], axis=1)
    slips = (pressure > 1e-6 * stress) & (moved > 1e-6 * length)
    along = np.einsum("ij,ij->i", v[:, :-1], sigma[:, :-1])
    assert np.allclose(
        along[slips], -(mu * pressure * moved)[slips], rtol=0, atol=slack * stress * length
    )


@pytest.mark.parametrize("ratio, mu", [(0.5, 0.3), (0.0, 4.0)])
def test_disks_on_a_half_space(ratio, mu):
    """A sphere pressed, pushed obliquely and turned: the same code as in the plane; Hertz where ν =
    1/2 uncouples."""
    x, weight, matrix = half_space(14, 1.4, ratio=ratio)
    force = 4.0 / 3.0 / (1.0 - ratio**2)
    law, gap = coulomb(len(x), mu, 3), 0.5 * np.sum(x**2, axis=1)
    start, slip = None, np.zeros((len(x), 2))
    for push in ((0.0, 0.0), (0.5, 0.5), (-0.3, 0.2)):
        loads = (push[0] * mu * force, push[1] * mu * force, force)
        system = pressed(matrix, weight, gap, loads, slip)
        state = NEWTON(system, law, iteration(start=start))
        assert state.converged and len(state.history) <= 12
        satisfies(law, system, state, mu)
        assert equilibrium_defect(system, state.sigma) < 1e-12
        if ratio == 0.5:
            contact = PointContact(force, 1.0, contact_modulus(1.0, ratio))
            exact = contact.pressure(np.linalg.norm(x, axis=1))
            assert np.linalg.norm(-state.sigma[:, 2] - exact) < 0.05 * np.linalg.norm(exact)
        start, slip = (state.v, state.sigma), slip + state.v[:, :-1]


def coupled_half_plane(count, sign):
    """ν = 0 on a rigid body: tangential and normal displacements are coupled as strongly as they
    can be."""
    x, weight, matrix = half_plane(count, 1.5, ratio=0.0)
    blocks = matrix.reshape(count, 2, count, 2)
    blocks[:, 1, :, 0] = sign * 0.5 * np.sign(x[:, None] - x) * weight
    blocks[:, 0, :, 1] = -blocks[:, 1, :, 0]
    return x, weight, blocks.reshape(2 * count, 2 * count)


@pytest.mark.parametrize(
    ("mu", "count", "sign"),
    [(0.0, 30, 1), (0.3, 100, -1), (1.0, 30, 1), (2.0, 30, -1), (4.0, 100, 1)],
)
def test_any_friction_from_a_cold_start(mu, count, sign):
    """A rigid parabola, pressed and shifted in one step, far and little."""
    x, weight, matrix = coupled_half_plane(count, sign)
    law = coulomb(count, mu, 2)
    for shift in (0.0, 0.05, 0.3, -1.0):
        overlap = np.column_stack([np.full(count, -shift), 0.2 - 0.5 * x**2])
        system = ReducedSystem(overlap, matrix, weight)
        state = NEWTON(system, law, iteration())
        assert state.converged, (shift, state.reason)
        satisfies(law, system, state, mu)


@pytest.mark.parametrize(
    ("rule", "k", "mu"), [(Modified, 2, 0.0), (SelfAdaptive, 2, 1.0), (Modified, 3, 0.4)]
)
def test_projection_with_two_rho_finds_what_newton_finds(rule, k, mu):
    if k == 2:
        x, weight, matrix = coupled_half_plane(40, 1)
        gap = 0.5 * x**2
    else:
        x, weight, matrix = half_space(8, 1.4)
        gap = 0.5 * np.sum(x**2, axis=1)
    u_0 = np.column_stack([np.full((len(gap), k - 1), -0.05), 0.2 - gap])
    system, law = ReducedSystem(u_0, matrix, weight), coulomb(len(gap), mu, k)
    exact = NEWTON(system, law, iteration())
    state = Projection(rule(), 1.0, 1.5)(system, law, iteration(1e-8, 3000))
    assert exact.converged and state.converged and len(state.history) < 400
    assert np.abs(state.sigma - exact.sigma).max() < 1e-5 * np.abs(exact.sigma).max()
    if mu > 0.0 and rule is Modified:
        assert np.asarray(state.rho)[0] != np.asarray(state.rho)[-1]  # each has its own


def test_projection_holds_bodies_by_contact_alone():
    x, weight, matrix = half_plane(40, 1.5)
    system = pressed(matrix, weight, 0.5 * x**2, (0.1, 0.7))
    law = coulomb(40, 0.4, 2)
    exact = NEWTON(system, law, iteration())
    state = Projection(Modified(), 1.0, 1.5)(system, law, iteration(1e-8, 3000))
    assert state.converged and equilibrium_defect(system, state.sigma) < 1e-12
    assert np.abs(state.sigma - exact.sigma).max() < 1e-4 * np.abs(exact.sigma).max()
    with pytest.raises(InputError, match="operator-robin"):
        OperatorRobin(1.8)(system, law, iteration())


def test_what_is_called_converged_is_a_solution_and_nearly_all_is():
    """Any positive definite matrix, however strongly it couples: Coulomb's law has no guarantee
    there, but no lie either."""
    solved = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        m, k, mu = int(rng.integers(1, 20)), 2 + seed % 2, rng.choice([0.0, 0.3, 1.0, 4.0])
        factor = rng.standard_normal((m * k, m * k))
        matrix = factor @ factor.T / (m * k) + 0.05 * np.eye(m * k)
        system, law = (
            ReducedSystem(rng.standard_normal((m, k)), matrix, np.ones(m)),
            coulomb(m, mu, k),
        )
        state = NEWTON(system, law, iteration())
        solved += state.converged
        if state.converged:
            satisfies(law, system, state, mu, 1e-6)
        else:
            assert mu > 0.0 and state.reason
    assert solved >= 98
