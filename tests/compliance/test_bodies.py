"""Bodies on compressed operators against dense ones, and methods that know S by its products."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from marks import slow
from prepared import Posed
from variants import Variant, drawn

from petcontact import Solution, load, solve
from petcontact.compliance.body.dense import DenseBody
from petcontact.compliance.body.hodlr import HodlrBody
from petcontact.contact.active_set.pivots import PATIENCE
from petcontact.given.tables.solver_options import Bem
from petcontact.pipeline import eliminate
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.run import run

pytestmark = pytest.mark.usefixtures("unestimated")

CONFIGS = Path(__file__).parents[2] / "configs"
TIGHT = Bem(mat_type="hodlr", hodlr_tol=1e-12, hodlr_leaf=32)


def config(name, **changes):
    return load(CONFIGS / f"{name}.toml").model_copy(update=changes)


def difference(one: Solution, other: Solution) -> float:
    """Largest difference of p and q over p, in L2, over all steps and pairs: Krylov methods promise
    norms, and a node of an element of 1e-7 has no weight in them."""
    worst = 0.0
    for a, b in zip(one.steps, other.steps, strict=True):
        for name, pair in b.pairs.items():
            for key in ("pressure", "sigma_t"):
                off = (getattr(a.pairs[name], key) - getattr(pair, key)).reshape(
                    len(pair.weight), -1
                )
                square = pair.weight @ off**2
                worst = max(worst, np.sqrt(square.sum() / (pair.weight @ pair.pressure**2)))
    return worst


def same_body(body, dense, tolerance):
    """u_0 in all states, S, and what follows from them on the whole boundary."""
    (n, d), (m, k) = dense.mesh.x.shape, dense.data.contact_shape
    assert body.u_0.shape == dense.u_0.shape == (dense.data.states, m, k)
    for ours, theirs in zip(body.u_0, dense.u_0, strict=True):
        assert np.abs(ours - theirs).max() <= tolerance * np.abs(dense.u_0).max()
    traction, size = np.cos(dense.mesh.x[dense.contact])[:, :k], np.abs(dense.compliance).max()
    columns = body.apply(np.eye(m * k)[:, :3]) - dense.compliance[:, :3]
    assert np.abs(columns).max() < tolerance * size
    product = body.apply(traction.ravel()) - dense.apply(traction.ravel())
    assert np.abs(product).max() < tolerance * size * m
    shares = np.arange(1.0, len(dense.u_0) + 1.0)
    ours, theirs = (b.unknowns(shares, traction) for b in (body, dense))
    assert len(theirs) == n * d + dense.modes.shape[2]
    assert np.abs(ours - theirs).max() < 10.0 * tolerance * np.abs(theirs).max()
    alpha = np.ones(dense.modes.shape[2])
    for each in (dense, body):
        boundary = each.boundary(shares, traction, alpha)
        assert each.residual(shares, *boundary, traction, alpha) < 10.0 * tolerance


@pytest.mark.parametrize("name", [slow("blade"), "pin"])
def test_compressed_body_is_the_dense_one(name, comm):
    """Held and free, with load states, point forces and all; S formed and not."""
    discrete = discretise(config(name))
    for number in range(len(discrete.meshes)):
        operators, modes = operators_of(discrete, number)
        dense = DenseBody(operators, modes, comm)
        formed, products = (HodlrBody(operators, modes, TIGHT, comm, most) for most in (1000, 0))
        assert products.compliance is None
        # only dense rows are exact for translations of rounded nodes
        off = np.abs(formed.compliance - dense.compliance).max()
        assert off < 1e-9 * np.abs(dense.compliance).max()
        for body in (formed, products):
            same_body(body, dense, 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("case", (0, 3, "stack", "pin", 7))
def test_assemblies_by_products_are_the_dense_ones(case, monkeypatch):
    """Configs and random pairs, pressed, stuck and held by a force; S is never formed, Newton is
    GMRES with T and rigid motions in it."""
    assembly = config(case) if isinstance(case, str) else drawn(1, case, Variant())
    dense = run(Posed(assembly).prepared)
    monkeypatch.setattr(eliminate, "FORMED", 0)
    posed = Posed(assembly.model_copy(update={"bem": TIGHT}))
    assert posed.bodies.operator.matrix_free
    found = run(posed.prepared)
    assert (dense.status, found.status) == ("converged", "converged")
    # compression to 1e-12 and GMRES to 1e-10 leave 1e-8 of p of the pin, on elements of 1e-7
    assert difference(found, dense) < 1e-7
    steps = zip(found.steps, dense.steps, strict=True)
    assert all(step.iterations <= max(10, other.iterations) for step, other in steps)
    # and S is formed where contact is small
    monkeypatch.undo()
    assert difference(run(Posed(assembly.model_copy(update={"bem": TIGHT})).prepared), dense) < 1e-7


def test_newton_finds_its_sets_before_exchanges_may_cycle():
    """From one step to the next, with all of a step's load in one increment."""
    for name in ("blade", "wedge"):
        case = config(name)
        whole = tuple(step.model_copy(update={"increments": 1}) for step in case.step)
        solution = solve(case.model_copy(update={"step": whole}))
        assert max(step.iterations for step in solution.steps) <= PATIENCE
