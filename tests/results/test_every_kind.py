"""What can be done with a solution of every kind of problem: files, tables and fields by Python."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from marks import some
from problems import block, contact_pair, obstacle, posed

from petcontact import InputError, read_result, solve
from petcontact.geometry.rotation import lifted
from petcontact.model.case import load
from petcontact.results.numbers.peaks import stress_peaks
from petcontact.results.records import step_ends
from petcontact.results.report import as_json
from petcontact.results.tables import boundary_table

CONFIGS = Path(__file__).parents[2] / "configs"
LARGER = (
    block("upper", [-3.0, 0.0], [3.0, 2.0], mesh="element_size = 0.5", top=[0.0, -0.01])
    + block("lower", [-1.0, -1.0], [1.0, 0.0], mesh="element_size = 0.25", bottom=[0.0, 0.0])
    + contact_pair("gap", "upper.bottom", "lower.top", 0.3)
)
"""The secondary face is larger than the primary: nodes face nothing. The name of the pair is that
of a dataset."""


def config(name, overrides):
    return load(CONFIGS / f"{name}.toml", overrides)


ROD = {"bottom": [0.0, 0.0], "right": ("traction", [0.0, 0.0, 1e-4])}
TURNED = (
    'symmetry = "axial"\n'
    + block("rod", [0.0, 0.0], [1.0, 1.0], mesh="element_size = 0.25, order = 2", **ROD)
    + obstacle("chuck", [0.0, -1e-3], "rotation = 2e-3")
    + contact_pair("turned", "rod.top", "chuck", 0.5)
)


PROBLEMS = {
    "plane, one body": lambda: config("example1", {"mesh.element_size": 0.5}),
    "plane, bodies": lambda: posed(LARGER),
    "torsion": lambda: posed(TURNED),
    "space, one body": lambda: config("space_b", {"mesh.element_size": 4.0, "mesh.order": 0}),
    "space, bodies": lambda: config(
        "space_stack", {f"body.{k}.mesh": {"element_size": 1.0, "order": 1} for k in range(2)}
    ),
}


@pytest.fixture(
    scope="module",
    params=some(PROBLEMS.keys() - {"space, bodies"}, PROBLEMS),
)
def solution(request):
    return solve(PROBLEMS[request.param]())


def test_what_is_written_is_read(solution, tmp_path):
    """Infinite gaps of nodes that face nothing, too."""
    assert solution.converged, solution.reason
    solution.save(tmp_path / "r.h5")
    again = read_result(tmp_path / "r.h5")
    assert again.verdict() == solution.verdict() and repr(again) == repr(solution)
    assert max(map(len, solution.verdict().splitlines())) <= 80
    for key in ("problem", "findings", "status", "reason"):
        assert getattr(again, key) == getattr(solution, key), key
    for name, body in solution.bodies.items():
        assert np.array_equal(again.bodies[name].u, body.u)
        assert np.array_equal(again.bodies[name].traction, body.traction)
    assert as_json(again.provenance) == as_json(solution.provenance)
    for step, other in zip(again.steps, solution.steps, strict=True):
        assert vars(step.history) == vars(other.history)
        assert (step.rho, step.residual) == (other.rho, other.residual)
        assert list(step.pairs) == list(other.pairs)
        for name, pair in other.pairs.items():
            for key in {*vars(pair), "pressure_error", "sigma_t_error"} - {"errors", "_errors"}:
                value = getattr(pair, key)
                assert value is None or np.array_equal(getattr(step.pairs[name], key), value), key
    for key, values in again.columns().items():
        assert np.array_equal(values, solution.columns()[key]), key
    for pair in filter(None, [solution.pairs.get("gap")]):
        assert np.isinf(pair.gap).any() and np.all(pair.state[np.isinf(pair.gap)] == 2)


def test_a_table_and_the_rich_display(solution):
    table = pytest.importorskip("pandas") and solution.to_dataframe()
    assert len(table) == sum(len(nodes) for nodes in solution.nodes.values())
    assert set(table.pair) == set(solution.pairs)
    force = sum(pair.force for pair in solution.pairs.values())
    normal = np.concatenate([pair.normal for pair in solution.pairs.values()])
    normal = lifted(normal, len(force))
    along = np.concatenate([pair.tangent for pair in solution.pairs.values()])
    shear = table[[name for name in table.columns if name.startswith("sigma_t")]].to_numpy()
    traction = table.sigma_n.to_numpy()[:, None] * normal + np.einsum("mt,mtc->mc", shear, along)
    assert np.allclose(table.weight.to_numpy() @ traction, force)
    assert solution._repr_html_().startswith("<pre>")


def test_views_of_one_body_are_refused_of_several(solution):
    if len(solution.meshes) == 1:
        shape = (solution.mesh.n_nodes, solution.mesh.components)
        assert solution.u.shape == solution.traction.shape == shape
        assert set(solution.reactions()) == set(solution.mesh.part_names)
        assert np.all(np.diff(solution.contact.nodes) > 0)
        return
    for name in ("u", "traction", "mesh", "contact", "zones"):
        with pytest.raises(InputError, match=f"{name}: of one body only; this solution has"):
            getattr(solution, name)
    assert set(solution.reactions()) == set(solution.meshes)


def test_stress_on_the_boundary(solution, tmp_path):
    """At nodes as at the same points by coordinates; with the normal it is the traction; in file,
    table and verdict."""
    solution.save(tmp_path / "r.h5")
    count = len(solution.steps)
    for name, mesh in solution.meshes.items():
        stress = solution.stress_on_boundary(name)
        some = np.arange(0, mesh.n_nodes, max(1, mesh.n_nodes // 9))
        size = np.abs(stress).max()
        assert np.abs(solution.stress_at(mesh.x[some], name) - stress[some]).max() < 1e-9 * size
        d = mesh.components
        tensor = solution.state_at(mesh.x[some], name).tensor[:, :d, :d]
        traction = np.einsum("nij,nj->ni", tensor, lifted(mesh.normal[some], d))
        assert np.abs(traction - solution.bodies[name].traction[some]).max() < 1e-9 * size
        with h5py.File(tmp_path / "r.h5") as file:
            assert np.array_equal(file[f"steps/{count}/body/{name}/stress"], stress)
    table = boundary_table(solution, solution.last)
    shear = [
        solution.stress_on_boundary(name)[:, 2 if mesh.components == 2 else 3]
        for name, mesh in solution.meshes.items()
    ]
    assert np.array_equal(table["sigma_xy"], np.concatenate(shear))
    peaks = stress_peaks(solution)
    # all of a coarse mesh may lie beside edges without a bound
    assert re.search("  largest von Mises stress: |has no bound", solution.verdict())
    for name, values in (("von Mises", "von_mises"), ("first principal", "first_principal")):
        stresses = [each for each in peaks if each.name.startswith(name)]
        assert stresses
        for peak in (each for each in stresses if np.isfinite(each.value[0])):
            (step,) = [each for each in step_ends(solution.steps) if each.step == peak.step][-1:]
            found = solution.state_at(peak.place[None], peak.of, step, peak.part or None)
            assert peak.value[0] == pytest.approx(getattr(found, values)[0], rel=1e-6)
