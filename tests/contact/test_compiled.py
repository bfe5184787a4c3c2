"""Steps of Newton's method in C against those in numpy."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.compliance.composed import ReducedSystem
from petcontact.contact import friction_law, laws, linearisation
from petcontact.contact.active_set import pivots, solvers
from petcontact.contact.criterion import Criterion
from petcontact.contact.iteration import Iteration
from petcontact.contact.laws import SignoriniCoulomb, Tresca
from petcontact.contact.methods.newton import SemismoothNewton

KERNELS = {
    friction_law: ["_NORMS"],
    laws: ["_COULOMB", "_RESIDUAL"],
    linearisation: ["_LINEARISE", "_TRACTION"],
    pivots: ["_NEXT_TAU"],
    solvers: ["_BLOCK"],
}


def problem(k, seed):
    """Nodes on a layer that is soft, coupled and not symmetric, some of them pressed and some
    pulled."""
    rng, m = np.random.default_rng(seed), 40
    roots = rng.normal(size=(m * k, m * k)) / np.sqrt(m * k)
    compliance = (
        roots @ roots.T + np.eye(m * k) + 0.05 * rng.normal(size=(m * k, m * k)) / np.sqrt(m * k)
    )
    law = (
        Tresca(rng.random(m))
        if k == 1
        else SignoriniCoulomb(0.3 * rng.random(m), np.full(m, np.inf), np.ones(m, bool), k)
    )
    return ReducedSystem(rng.normal(size=(m, k)), compliance, rng.random(m) + 0.5), law


@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_compiled_steps_are_those_of_numpy(k, seed, monkeypatch):
    def solved():
        return SemismoothNewton(predict=False)(*problem(k, seed), Iteration(Criterion(1e-8), 60))

    compiled = solved()
    for module, names in KERNELS.items():
        for name in names:
            monkeypatch.setattr(module, name, None)
    plain = solved()
    assert compiled.converged and plain.converged
    assert compiled.history.exchanged == plain.history.exchanged
    np.testing.assert_array_equal(compiled.states, plain.states)
    for one, other in (
        (compiled.v, plain.v),
        (compiled.sigma, plain.sigma),
        (compiled.history.residual, plain.history.residual),
    ):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)
    assert set(compiled.states.tolist()) >= ({0, 1} if k == 1 else {1, 2})


def test_norms_neither_overflow_nor_underflow():
    weight, groups = np.array([0.5, 1.5]), (slice(0, 1), slice(1, 2))
    x = np.array([[3.0, 0.0], [4.0, 0.0]])
    expected = np.sqrt(0.5 * 9.0 + 1.5 * 16.0)
    for scale in (1e-200, 1.0, 1e200):
        (found,) = friction_law.group_norms(weight, groups, scale * x)
        np.testing.assert_allclose(found, [scale * expected, scale * expected, 0.0], rtol=1e-14)
    assert np.isnan(friction_law.group_norms(weight, groups, np.nan * x)[0]).all()
    assert friction_law.group_norms(weight, groups[:1], np.inf * x[:, :1]) == [[np.inf, np.inf]]
