"""Bodies of revolution against closed forms."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from axial_forms import indented, indented_errors
from climbs import solved
from random_revolution import random_revolution
from shapes import closing, drawn, elastic, moved, problem, rectangle, rollers, solid, touching

from petcontact import InputError, Obstacle, adapt, operators, solve
from petcontact.geometry.rotation import PLANE, REVOLUTION, TORSION
from petcontact.pipeline.condensation import condensed_body

E, NU = 100.0, 0.3
LOADED = {**elastic(E, NU), "density": 2.0, "thermal_expansion": 1e-3}


def axial(**tables):
    return problem(symmetry="axial", **tables)


@pytest.mark.parametrize("load", [{"angular_velocity": 3.0}, {"temperature": "x"}])
def test_speed_and_heat_of_a_tube(load):
    """σ_rr and σ_θθ in a long tube, 1 < r < 2, between planes of symmetry."""
    posed = axial(
        material=LOADED,
        geometry=rectangle([1, 0], [2, 1]),
        mesh={"element_size": 0.5, "order": 3},
        boundary=[drawn("left", [0, 0]), drawn("right", [0, 0]), *rollers("bottom", "top")],
        loads=load,
    )
    body, x = operators(posed).body, np.array([[1.2, 0.3], [1.7, 0.6]])
    state, r = body.state_at(x, *body.solve()), x[:, 0]
    if "temperature" in load:
        scale, within, error = E * 1e-3 / (1 - NU) / r**2, (r**3 - 1) / 3, 1e-5
        radial = scale * ((r**2 - 1) * 7 / 9 - within)
        hoop = scale * ((r**2 + 1) * 7 / 9 + within - r**3)
    else:
        k, ratio, error = 2.0 * 9.0 / 8.0, NU / (1 - NU), 1e-3
        radial = (3 + ratio) * k * (5 - 4 / r**2 - r**2)
        hoop = (3 + ratio) * k * (5 + 4 / r**2) - (1 + 3 * ratio) * k * r**2
    assert state.stress[:, 0] == pytest.approx(radial, abs=error)
    assert state.stress[:, 2] == pytest.approx(hoop, abs=error)
    assert state.sigma_zz == pytest.approx(hoop, abs=error)


BLOCK = rectangle([0, 0], [2, 1])


def pressed(block, base=None):
    """A block on a base, both of elements of one size."""
    more = {"material": elastic(E, NU), "mesh": {"element_size": 0.5, "order": 1}}
    held = solid("base", rectangle([0, -1], [3, 0]), moved("bottom", [0, 0]), **more)
    upper = solid("block", block, moved("top", ["free", -0.01]), **more)
    pair = touching("pair", "block.bottom", "base.top", friction_coefficient=0.3)
    return axial(body=[upper, base or held], contact=[pair])


def test_lines_of_mesh_files_on_the_axis_need_no_group(tmp_path):
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], dtype=float)
    names = {name: np.array([k, 1]) for k, name in enumerate(("bottom", "right", "top"), 1)}
    kinds = [("line", np.array([[0, 1], [1, 2], [2, 3]]))]
    kinds += [("quad", np.array([[0, 1, 2, 3]]))]
    tags = [np.array([1, 2, 3]), np.array([9])]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(corners, kinds, cell_data=data, field_data=names).write(
        tmp_path / "block.msh", file_format="gmsh22", binary=False
    )
    file = {"shape": "gmsh", "file": str(tmp_path / "block.msh")}
    forces = [solve(pressed(block)).pairs["pair"].force for block in (BLOCK, file)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-12)


def test_a_superelement_carries_what_its_body_does_and_is_none_of_the_plane(tmp_path):
    whole = solve(pressed(BLOCK))
    condensed_body(whole, "base").save(tmp_path / "base.npz")
    file = {"shape": "superelement", "file": str(tmp_path / "base.npz")}
    posed = pressed(BLOCK, solid("base", file, material=elastic(E, NU)))
    assert solve(posed).pairs["pair"].force == pytest.approx(whole.pairs["pair"].force, rel=1e-9)
    with pytest.raises(InputError, match=r"base.npz: axial: this superelement is a body of revol"):
        solve(posed.model_copy(update={"symmetry": None}))


def test_one_number_moves_an_obstacle_along_the_axis():
    """It was refused, though an obstacle has no other way; in 2D it is, but for 0."""
    punch = Obstacle("punch", displacement=-0.02, force=3.0)
    for kind, whole in (REVOLUTION, [0.0, -0.02]), (TORSION, [0.0, -0.02, 0.0, 0.0]):
        assert punch.motions(kind) == whole
        assert punch.loads(kind)[:2] == [0.0, 3.0]
    with pytest.raises(InputError, match="needs 2 components here"):
        punch.loads(PLANE)


HELD = [moved("bottom", [0, 0]), drawn("right", [0, 0])]
TOP = closing("top", normal="unilateral", gap=-0.01)
LEFT = drawn("left", [0, 0])
AROUND = {"part": "left", "condition": "periodic", "partner": "right"}


def punched(**motion):
    punch = {"name": "punch", "displacement": [0, -0.01], **motion}
    return {"boundary": HELD, "contact": [touching("pair", "top", "punch")], "obstacle": [punch]}


def forced(x, y):
    return {"point_force": [{"at": [x, y], "force": [1, 1]}]}


@pytest.mark.parametrize(
    ("told", "changes"),
    [
        (
            r"test: geometry: side 'bottom' has r < 0 at \(-1, 0\)",
            {"geometry": rectangle([-1, 0], [1, 1]), "boundary": [*HELD, TOP, LEFT]},
        ),
        (
            r"test: boundary\[3\].part: 'left' lies on the axis x = 0",
            {"boundary": [*HELD, TOP, LEFT]},
        ),
        (
            r"bottom.value\[0\]: is 0.1 at \(0, 0\), on the axis, where u_r is 0",
            {"boundary": [moved("bottom", [0.1, 0]), HELD[1], TOP]},
        ),
        (
            "left.partner: 'right' lies at other radii",
            {"geometry": rectangle([1, 0], [2, 1]), "boundary": [AROUND, HELD[0], TOP]},
        ),
        ("rotation: nothing turns about the axis here", punched(rotation="free")),
        (r"force\[0\]: it moves along the axis of revolution only, got 1", punched(force=[1, 0])),
        ("material.plane: a body of revolution is no", {"material": {**LOADED, "plane": "stress"}}),
        ("compresses boundaries of plane bodies", {"bem": {"mat_type": "hodlr"}}),
        (r"acceleration\[0\]: is 9.8", {"loads": {"acceleration": [9.8, 0]}}),
        (
            r"loads.centre\[0\]: is 1; a body of revolution turns about its axis",
            {"loads": {"angular_velocity": 1, "centre": [1, 0]}},
        ),
        (r"point_force\[0\].force\[0\]: is 1 on the axis", forced(0, 0.5)),
        (r"at: \[-0.5, 0.5\] does not lie inside the body", forced(-0.5, 0.5)),
    ],
)
def test_what_is_no_body_of_revolution_is_refused(told, changes):
    usual = {"material": LOADED, "geometry": rectangle([0, 0], [1, 1]), "boundary": [*HELD, TOP]}
    with pytest.raises(InputError, match=told):
        solve(axial(**{**usual, "mesh": {"element_size": 0.5, "order": 1}, **changes}))


@pytest.mark.parametrize(("name", "least"), [("cone", 1e-3), ("flat", np.inf)])
def test_indenters_of_a_half_space(name, least):
    """The pressure of a cone has a logarithm on the axis, which meshes are graded to; that of a
    flat punch is not square integrable."""
    found = adapt(indented(name), 1e-2)
    force, pressure = indented_errors(name, found)
    assert found.converged and found.accuracy.error < 1e-2
    assert force < 1e-5 and pressure < least


def test_a_random_problem_reaches_what_is_wanted_and_reports_no_less_than_the_error():
    """One of those that scripts/verify_axial draws."""
    (found,) = solved(random_revolution, 1, 0, [2e-2], 2e-4)
    assert found.status == "converged"
    assert found.true <= min(found.accuracy, found.estimate)
