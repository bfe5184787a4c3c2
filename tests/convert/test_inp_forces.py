"""Loads and contacts of input files: forces at nodes as tractions, faces that are held and pressed,
bodies of revolution, ties, clearances and loads of the volume."""

from __future__ import annotations

import numpy as np
import pytest
from inp_decks import converted, grid, sets

from petcontact import solve
from petcontact.convert.inp_forces import linear_traction, written

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.25
*DENSITY
2.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
"""


def block(kind, *more, size=(1.0, 1.0), counts=(2, 2)):
    """A block of elements with sets FOOT, HEAD, LEFT and RIGHT of its nodes."""
    d = len(size)
    text, number = grid([0.0] * d, size, counts, 1, 1, kind, "ALL")
    text += sets("FOOT", number, d - 1, 0) + sets("HEAD", number, d - 1, counts[-1])
    text += sets("LEFT", number, 0, 0) + sets("RIGHT", number, 0, counts[0])
    return "\n".join([*text, MATERIAL.strip(), *more])


@pytest.mark.parametrize("d", [2, 3])
def test_a_traction_has_the_resultant_and_the_moments_of_forces(d):
    """On faces in general position, integrated by Gauss's rule of three points."""
    rng = np.random.default_rng(5)
    at = rng.normal(size=(6, d))
    shape = [(0, 1), (1, 2), (4, 5)] if d == 2 else [(0, 1, 2), (1, 2, 3), (2, 3, 4)]
    points, forces = rng.normal(size=(7, d)), rng.normal(size=(7, d))
    found = written(
        linear_traction([at[list(corners)] for corners in shape], points, forces, False)
    )
    first, force = np.zeros((d, d)), np.zeros(d)
    gauss, weight = np.polynomial.legendre.leggauss(3)
    for corners in shape:
        a, b, c = (*at[list(corners)], at[corners[0]])[:3]
        for s, ws in zip(0.5 + 0.5 * gauss, 0.5 * weight, strict=True):
            for t, wt in zip(0.5 + 0.5 * gauss, 0.5 * weight, strict=True):
                if d == 2:
                    x, area = a + s * (b - a), np.linalg.norm(b - a)
                else:
                    x = a + s * (b - a) + s * t * (c - b)
                    area = s * np.linalg.norm(np.cross(b - a, c - a))
                names = dict(zip("xyz", x, strict=False))
                traction = np.array([eval(str(one), {}, names) for one in found])
                force += ws * wt * area * traction
                first += ws * wt * area * np.outer(x, traction)
    assert np.allclose(force, forces.sum(axis=0), atol=1e-8)
    assert np.allclose(first, points.T @ forces, atol=1e-8)


def test_forces_of_a_uniform_pressure_are_a_uniform_traction(tmp_path):
    """Those of elements of second order are 1/6, 4/6 and 1/6 of an edge's."""
    nodes = [(0, 0), (3, 0), (3, 1), (0, 1), (1.5, 0), (3, 0.5), (1.5, 1), (0, 0.5)]
    lines = [f"{k}, {x}, {y}" for k, (x, y) in enumerate(nodes, 1)]
    text = ["*NODE", *lines, "*ELEMENT, TYPE=CPE8, ELSET=ALL", "1, 1, 2, 3, 4, 5, 6, 7, 8"]
    text += [*MATERIAL.split("\n"), "0.5", "*STEP", "*CLOAD", "3, 2, -1.", "4, 2, -1.", "7, 2, -4."]
    problem, notes = converted(tmp_path, "\n".join(text))
    (condition,) = problem.body[0].boundary
    assert condition.value == (0.0, -4.0) and not notes
    assert problem.body[0].material.thickness == 0.5  # forces are whole ones


def test_a_face_that_is_held_sideways_is_pressed_in_two_steps(tmp_path):
    steps = ["*STEP", "*DLOAD", "ALL, P3, 2.", "*END STEP"]
    steps += ["*STEP", "*DLOAD", "ALL, P3, 5.", "*CLOAD", "HEAD, 2, 1.", "*END STEP"]
    text = block("CPE4", "*BOUNDARY", "FOOT, 1, 2", "HEAD, 1", "LEFT, 1", "RIGHT, 1", *steps)
    problem, _ = converted(tmp_path, text.replace("ALL, P3", "2, P3, 0.\n4, P3"))
    solution = solve(problem)
    assert solution.converged, solution.reason
    head = [
        sum(r[1] for part, r in solution.reactions(s).items() if "HEAD" in part)
        for s in solution.steps
    ]
    assert np.allclose(head, [-1.0, 3.0 - 2.5], rtol=1e-3)


def test_a_cylinder_carries_the_whole_force_of_its_rings(tmp_path):
    """CAX4: one-dimensional strain, the force at the nodes that of the whole circle."""
    text = block(
        "CAX4", "*BOUNDARY", "FOOT, 2, 2", "LEFT, 1", "RIGHT, 1", "*STEP", "*CLOAD", "HEAD, 2, -1."
    )
    problem, notes = converted(tmp_path, text)
    assert problem.symmetry == "axial" and notes == []
    solution = solve(problem)
    assert solution.reactions()["FOOT"][1] == pytest.approx(3.0, rel=1e-3)


def test_a_force_inside_is_one_at_a_point_and_the_volume_turns(tmp_path):
    more = ["*STEP", "*CLOAD", "5, 1, 3.", "*DLOAD", "ALL, CENTRIF, 4., 0.5, 0.5, 0., 0., 0., 1."]
    more += ["*END STEP", "*STEP", "*CLOAD", "5, 1, 7.", "*DLOAD", ", GRAV, 9., 0., -1., 0."]
    problem, _ = converted(tmp_path, block("CPS4", "*BOUNDARY", "FOOT, 1, 2", *more))
    (body,) = problem.body
    assert (body.material.plane, body.material.density) == ("stress", 2.0)
    assert body.point_force[0].at == (0.5, 0.5) and body.point_force[0].force == (3.0, 0.0)
    assert body.loads.angular_velocity == 2.0 and body.loads.centre == (0.5, 0.5)
    assert problem.step[1].point_force[0].force == (7.0, 0.0)
    assert problem.step[1].loads[0].acceleration == (0.0, -9.0)


@pytest.mark.parametrize(
    ("statement", "behaviour", "normal", "coefficient"),
    [
        ("*TIE, NAME=T", "PRESSURE-OVERCLOSURE=HARD", "bonded", None),
        ("*CONTACT PAIR, INTERACTION=I", "PRESSURE-OVERCLOSURE=TIED", "bonded", None),
        ("*CONTACT PAIR, INTERACTION=I", "NO SEPARATION", "bilateral", 0.3),
    ],
)
def test_what_a_contact_is_and_its_clearance(statement, behaviour, normal, coefficient, tmp_path):
    low, _ = grid([0.0, 0.0], [1.0, 1.0], (1, 1), 1, 1, "CPE4", "ALL")
    high, _ = grid([0.0, 1.0], [1.0, 2.0], (1, 1), 11, 11, "CPE4", "ALL")
    contact = [
        "*SURFACE INTERACTION, NAME=I",
        f"*SURFACE BEHAVIOR, {behaviour}",
        "*FRICTION",
        "0.3",
    ]
    contact += ["*SURFACE, NAME=LOW", "1, S3", "*SURFACE, NAME=HIGH, TYPE=NODE", "11", "13"]
    contact += ["*CLEARANCE, MASTER=LOW, SLAVE=HIGH, VALUE=0.01"]
    contact += [statement, "HIGH, LOW", "*BOUNDARY", "1, 1, 2", "3, 1, 2"]
    problem, notes = converted(tmp_path, "\n".join([*low, *high, MATERIAL.strip(), *contact]))
    (pair,) = problem.contact
    assert (pair.normal, pair.friction_coefficient, pair.gap) == (normal, coefficient, 0.01)
    assert pair.secondary == "body2.HIGH" and notes == []
    steps = ["*STEP", "*END STEP", "*STEP", "*CHANGE FRICTION, INTERACTION=I", "*FRICTION", "0.1"]
    problem, notes = converted(
        tmp_path, "\n".join([*low, *high, MATERIAL.strip(), *contact, *steps])
    )
    changed = [change.friction_coefficient for change in problem.step[1].contact]
    assert changed == [0.1] * (normal != "bonded") and notes == []


def test_nodes_that_are_held_one_by_one_hold_their_faces(tmp_path):
    text = block("CPE4", "*BOUNDARY", "1, 1, 2", "3, 2, 2", "3, 1, 1", counts=(1, 1))
    (condition,) = converted(tmp_path, text)[0].body[0].boundary
    assert (condition.part, condition.value) == ("NODES1+NODES2", (0.0, 0.0))


def ring(*more: str) -> str:
    """A quarter of a ring of radii 1 and 2, of three curved elements, in plane strain."""
    at = {
        (i, j): (1.0 + 0.5 * i) * np.array([np.cos(j * np.pi / 12.0), np.sin(j * np.pi / 12.0)])
        for i in range(3)
        for j in range(7)
        if i % 2 == 0 or j % 2 == 0
    }
    number = {place: k for k, place in enumerate(at, 1)}
    order = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
    text = ["*NODE", *(f"{number[p]}, {x:.12f}, {y:.12f}" for p, (x, y) in at.items())]
    text += ["*ELEMENT, TYPE=CPE8R, ELSET=ALL"]
    text += [
        f"{k + 1}, " + ", ".join(str(number[i, 2 * k + j]) for i, j in order) for k in range(3)
    ]
    for name, line in (("START", [(i, 0) for i in range(3)]), ("END", [(i, 6) for i in range(3)])):
        text += [f"*NSET, NSET={name}", ", ".join(str(number[place]) for place in line)]
    return "\n".join([*text, MATERIAL.strip(), "*STEP", *more])


def test_edges_of_second_order_are_arcs(tmp_path):
    """Lamé's ring under pressure inside."""
    deck = ring("*BOUNDARY", "START, 2", "END, 1", "*DLOAD", "ALL, P4, 1.0")
    problem, notes = converted(tmp_path, deck)
    assert not notes
    solution = solve(problem)
    (body,) = problem.body
    young, ratio = body.material.young_modulus, body.material.poisson_ratio
    mesh = solution.meshes[body.name]
    inside = np.abs(np.hypot(*mesh.x.T) - 1.0) < 1e-9
    moved = np.linalg.norm(solution.last.bodies[body.name].u[inside], axis=1)
    expected = (1.0 + ratio) / young / 3.0 * (1.0 - 2.0 * ratio + 4.0)
    assert np.allclose(moved, expected, rtol=1e-5)


def test_forces_on_a_curved_edge_have_their_moment(tmp_path):
    """Where nodes lie in the middle of edges, too: 1/6, 4/6 and 1/6 of a shear of an arc. The first
    node is held."""
    along = ["*CLOAD"]
    for at, size in ((1, 1.0), (2, 4.0), (3, 2.0), (4, 4.0), (5, 2.0), (6, 4.0), (7, 1.0)):
        turn = (at - 1) * np.pi / 12.0
        along += [f"OUT{at}, 1, {-size * np.sin(turn)}", f"OUT{at}, 2, {size * np.cos(turn)}"]
    deck = ring("*BOUNDARY", "START, 1, 2", *along)
    rows = [line.split(",") for line in deck.split("\n")[1:19]]
    outer = sorted(
        (np.arctan2(float(y), float(x)), n)
        for n, x, y in rows
        if float(x) ** 2 + float(y) ** 2 > 3.9
    )
    for at, (_, number) in enumerate(outer, 1):
        deck = deck.replace(f"OUT{at},", f"{number},")
    problem, notes = converted(tmp_path, deck)
    assert not notes
    solution = solve(problem)
    (mesh,), (body,) = solution.meshes.values(), solution.last.bodies.values()
    held = mesh.nodes_of("START")
    force = mesh.weight[held, None] * body.traction[held]
    moment = np.sum(mesh.x[held, 0] * force[:, 1] - mesh.x[held, 1] * force[:, 0])
    assert moment == pytest.approx(-2.0 * 17.0, rel=1e-3)
