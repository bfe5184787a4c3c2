"""T in space: a symmetric stand-in for S, and what the methods make of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from prepared import Posed

from petcontact.compliance.half_space import HalfSpace
from petcontact.contact.criterion import Criterion
from petcontact.contact.iteration import Iteration
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.methods.operator_robin import OperatorRobin
from petcontact.model.case import load

pytestmark = pytest.mark.usefixtures("unestimated")

CONFIGS = Path(__file__).parents[2] / "configs"
SMALL = {"mesh.element_size": 2.0}


@pytest.fixture(scope="module", params=["space_b", "space_bracket"])
def prepared(request: pytest.FixtureRequest):
    result = Posed(
        load(
            CONFIGS / f"{request.param}.toml",
            {"mesh": {"order": 1}} if "bracket" in request.param else SMALL,
        )
    )
    yield request.param, result
    result.close()


def test_spectrum(prepared) -> None:
    """A prototype found [0.6, 2.7] with images, [1.0, 6.3] without; the bracket's foot is no
    rectangle."""
    name, problem = prepared
    layer, weight = problem.system.surrogate(), np.repeat(problem.weight, 2)
    weighted = weight[:, None] * layer.matrix()
    assert np.abs(weighted - weighted.T).max() < 0.02 * np.abs(weighted).max()
    assert np.linalg.eigvalsh(0.5 * (weighted + weighted.T)).min() > 0.0
    ratio = np.linalg.eigvals(np.linalg.solve(layer.matrix(), problem.system.compliance())).real
    low, high = (0.55, 20.0) if name == "space_bracket" else (0.55, 2.8)
    assert ratio.min() > low and ratio.max() < high


def test_operations_agree_with_the_matrix(prepared) -> None:
    layer = prepared[1].system.surrogate()
    assert isinstance(layer, HalfSpace)
    x = np.random.default_rng(1).normal(size=prepared[1].system.u_0.shape)
    layer.fit(x, 3.0 * layer.apply(x))
    assert layer.scale == pytest.approx(np.sqrt(3.0))
    matrix, flat = layer.matrix(), x.ravel()
    np.testing.assert_allclose(layer.apply(x).ravel(), matrix @ flat)
    np.testing.assert_allclose(matrix @ layer.solve(x).ravel(), flat)
    rho = 1.0 / np.trace(matrix)
    np.testing.assert_allclose(
        flat, (np.eye(len(flat)) + rho * matrix) @ layer.solve(x, rho).ravel()
    )
    held = x > 0.3
    found = layer.stick_solve(held, x)
    np.testing.assert_allclose(layer.apply(found)[held], x[held])
    assert not found[~held].any()
    assert not layer.stick_solve(held & False, x).any()  # all nodes slip beyond a limit load


def test_methods_on_disks(prepared) -> None:
    """Prediction brings Newton down to 4 steps on boxes; operator Robin takes 12 to 13 iterations
    there at ω = 1.8."""
    name, problem = prepared
    run = Iteration(Criterion(1e-8), 100)
    plain, predicted = (
        SemismoothNewton(predict=p)(problem.system, problem.law, run) for p in (False, True)
    )
    robin = OperatorRobin(1.8)(problem.system, problem.law, run)
    assert plain.converged and predicted.converged and robin.converged
    np.testing.assert_allclose(predicted.sigma, plain.sigma, atol=1e-7 * np.abs(plain.sigma).max())
    np.testing.assert_allclose(robin.v, plain.v, atol=1e-5 * np.abs(plain.v).max())
    if name != "space_bracket":
        assert len(predicted.history) <= 5 and len(robin.history) <= 20
