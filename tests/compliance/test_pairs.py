"""Bodies in space on H-matrices against dense ones: every law, motions of bodies and obstacles,
faces that do not match."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
from marks import some
from prepared import compressed_from
from shapes import cuboid, drawn, elastic, moved, outline, solid, touching

from petcontact import InputError, SolverError, solve
from petcontact.compliance.body.dense import DenseBody
from petcontact.compliance.hierarchical.body import HierarchicalBody
from petcontact.model.case import parse_problem
from petcontact.pipeline import choice
from petcontact.pipeline.pose import facing
from petcontact.pipeline.run import prepare

pytestmark = pytest.mark.usefixtures("unestimated")

TOLERANCE = 1e-5


BOTTOM, CURVED = moved("bottom", [0.0, 0.0, 0.0]), "0.05*(x**2 + y**2)"


def box(name, lower, upper, size, young, *conditions, **more):
    mesh = {"element_size": size, "order": 1}
    body = solid(name, cuboid(lower, upper), *conditions, material=elastic(young, 0.3), mesh=mesh)
    return body | more


def blocks(young=1.0, **contact):
    """Two blocks with a gap, pressed, then pushed."""
    lower = box("lower", [-1, -1, -1], [1, 1, 0], 0.5, young, BOTTOM)
    upper = box("upper", [-1, -1, 0], [1, 1, 1], 0.5, 1.0, moved("top", [0.0, 0.0, -0.02]))
    pair = touching("pair", "lower.top", "upper.bottom", **{"gap": CURVED} | contact)
    push = {"body": "upper", "part": "top", "value": [0.01, 0.0, -0.02]}
    return {
        "body": [lower, upper],
        "contact": [pair],
        "method": {"tolerance": 1e-7},
        "step": [{"name": "press"}, {"name": "push", "boundary": [push]}],
    }


def floating():
    """A stack of three that contact holds, on panels that do not match, with a point force and
    weight."""
    force = {"at": [0.1, 0, 0.3], "force": [0.001, 0, -0.004]}
    weight, pull = {"force": [0.0, 0.0, -0.002]}, drawn("top", [0.001, 0.0, -0.01])
    bottom = box("bottom", [-1, -1, -0.6], [1, 1, 0], 0.6, 1.0, BOTTOM)
    middle = box("middle", [-1, -1, 0], [1, 1, 0.6], 0.6, 3.0, point_force=[force])
    top = box("top", [-0.8, -0.7, 0.6], [0.7, 0.8, 1.2], 0.41, 2.0, pull, loads=weight)
    one = touching("one", "middle.bottom", "bottom.top", friction_coefficient=0.4)
    two = touching("two", "top.bottom", "middle.top", friction_coefficient=0.3)
    return {"body": [bottom, middle, top], "contact": [one, two]}


def punched():
    """A rigid punch, round below, that its force presses and draws and that may tilt."""
    punch = {
        "name": "punch",
        "displacement": ["free"] * 3,
        "rotation": ["free", "free", 0.0],
        "force": [0.001, 0.0, -0.02],
        "centre": [0.0, 0.0, 1.0],
    }
    contact = touching("one", "block.top", "punch", friction_coefficient=0.4, gap=CURVED)
    block = box("block", [-1, -1, -1], [1, 1, 0], 0.5, 1.0, BOTTOM)
    return {"body": [block], "obstacle": [punch], "contact": [contact]}


def on_ground():
    """A block that lies on rigid ground and is pushed by less than friction holds; one that slides
    on rollers beside it."""
    law = {"normal": "unilateral", "friction_coefficient": 0.5}
    ground = {"part": "bottom", "condition": "contact", **law}
    free = box("free", [0, 0, 0], [1, 1, 1], 0.5, 1.0, ground, drawn("top", [0.002, 0.0, -0.01]))
    roller, pressed = moved("left", [0.0, "free", "free"]), drawn("top", [0.0, 0.0, -0.02])
    return {"body": [free, box("half", [2, 0, 0], [3, 1, 1], 0.5, 2.0, ground, roller, pressed)]}


def squeezed():
    """A cylinder between two plates; its side is the secondary of both contacts, of which no node
    has something opposite twice."""
    roller = solid("roller", BODIES["lying"][0], mesh={"element_size": 0.5, "order": 1})
    lower = box("lower", [-1, -1, -0.6], [1, 1, 0], 0.7, 2.0, BOTTOM)
    lid = box("lid", [-1, -1, 1.2], [1, 1, 1.8], 0.7, 1.0, moved("top", [0.0, 0.0, -0.1]))
    pairs = [
        touching(name, "roller.side", other, direction=[0.0, 0.0, way], friction_coefficient=0.3)
        for name, other, way in (("low", "lower.top", -1.0), ("high", "lid.bottom", 1.0))
    ]
    return {"body": [roller, lower, lid], "contact": pairs}


SIZES = (0.25, 0.45, 0.6)
"""Of panels, by order."""
LAWS = ("frictionless", "Coulomb", "Tresca", "both", "bonded")
BODIES = {
    "box": (cuboid([-0.6, -0.7, 0.0], [0.8, 0.5, 0.8]), "bottom", "top"),
    "sphere": ({"shape": "sphere", "centre": [0, 0, 0.8], "radius": 0.8}, "bottom", "top"),
    "standing": (
        {"shape": "cylinder", "from": [0, 0, 0], "to": [0, 0, 0.8], "radius": 0.7},
        "bottom",
        "top",
    ),
    "lying": (
        {"shape": "cylinder", "from": [-0.8, 0, 0.6], "to": [0.8, 0, 0.6], "radius": 0.6},
        "side",
        "bottom",
    ),
}
"""Geometry of the upper body, the part that faces the lower one, and the part that is loaded."""


def random_pair(seed):
    """A body on a block, either the secondary; driven by displacements, or by loads alone."""
    draw = np.random.default_rng(seed)
    kind, law = str(draw.choice(list(BODIES))), str(draw.choice(LAWS))
    orders = draw.integers(3, size=2).tolist()
    young, mu = float(10.0 ** draw.uniform(-2, 2)), float(draw.uniform(0.2, 0.6))
    press, depth = 0.01 * min(1.0, young), float(draw.uniform(0.01, 0.03))
    geometry, facing, loaded = BODIES[kind]
    flat = kind in ("box", "standing")
    contact = {"gap": "geometry"} if not flat else {}
    contact |= {"friction_coefficient": mu} if law in ("Coulomb", "both") else {}
    contact |= {"friction_bound": 0.3 * press} if law in ("Tresca", "both") else {}
    contact = {"normal": "bonded"} if law == "bonded" else contact
    sides = [f"upper.{facing}", "lower.top"][:: draw.choice([1, -1])]
    contact |= {"name": "pair"} | dict(zip(("secondary", "primary"), sides, strict=True))
    # what contact alone holds is pressed by less shear than it can hold
    free = law in ("Coulomb", "bonded") and flat and draw.random() < 0.7
    way = [0.4 * mu * press, 0.0, -press] if free else [0.3 * depth, 0.0, -depth]
    drive = (drawn if free else moved)(loaded, [0.0, 0.0, way[2]])
    meshes = [{"order": order, "element_size": SIZES[order]} for order in orders]
    block = cuboid([-1, -1, -1], [1, 1, 0])
    bodies = [
        solid("lower", block, BOTTOM, material=elastic(young, 0.25), mesh=meshes[0]),
        solid("upper", geometry, drive, mesh=meshes[1]),
    ]
    push = {"boundary": [{"body": "upper", "part": loaded, "value": way}]}
    push |= {"increments": int(draw.integers(1, 3))}
    # of a compressed pair fewer increments are affordable than of a dense one
    steps = [{"increments": 1}, push]
    return {"body": bodies, "contact": [contact], "step": steps, "method": {"tolerance": 1e-7}}


CASES = {
    "Coulomb": lambda: blocks(friction_coefficient=0.3),
    "Tresca": lambda: blocks(1e-2, friction_bound=0.0005),
    "bonded": lambda: blocks(normal="bonded"),
    "floating": floating,
    "punch": punched,
    "ground": on_ground,
    "squeezed": squeezed,
    "worn": lambda: blocks(friction_coefficient=0.3, wear_coefficient=5.0),
} | {f"random pair {seed}": functools.partial(random_pair, seed) for seed in range(12)}


def solved(data, mat_type, tolerance=1e-4):
    bem = {"bem.mat_type": mat_type, "bem.hmatrix_tol": tolerance}
    return solve(parse_problem(data, "test", bem, Path()))


def compressed(data, tolerance=1e-4):
    return solved(data, "hmatrix", tolerance)


@pytest.mark.parametrize("name", some(("Coulomb", "ground", "squeezed"), CASES))
def test_bodies_are_solved_as_on_dense_operators(name):
    """The same sets, and everything to some ten times the tolerance of the compression, each body
    by its own size; random pairs by that of both, whatever the outcome is."""
    dense, found = solved(CASES[name](), "dense"), compressed(CASES[name](), TOLERANCE)
    chance = "random" in name
    assert (found.status, len(found.steps)) == (dense.status, len(dense.steps)), found.reason
    assert dense.converged or chance, dense.reason
    assert "hmatrix" in found.provenance.solver
    assert found.provenance.motions == dense.provenance.motions

    def near(ours, wanted, times=10.0, size=0.0):
        allowed = times * TOLERANCE * (size or np.abs(wanted).max() + 1e-12)
        return np.abs(ours - wanted).max() <= allowed

    for step, other in zip(found.steps, dense.steps, strict=True):
        assert max(step.history.ksp_iterations) <= (60 if chance else 20)
        assert step.residuals["balance"] <= 1e-6
        for key, pair in other.pairs.items():
            mine, size = step.pairs[key], np.abs(pair.pressure).max()
            assert np.array_equal(mine.state, pair.state) and near(mine.force, pair.force)
            assert near(mine.pressure, pair.pressure, 10.0 if chance else 20.0, size)
            # a given bound of friction may be a thousand times the pressure at first contact
            size = max(size, np.abs(pair.sigma_t).max())
            assert near(mine.sigma_t, pair.sigma_t, 20.0, size)
            assert pair.wear is None or near(mine.wear, pair.wear, 20.0)
        most = max(np.abs(body.u).max() for body in other.bodies.values()) if chance else 0.0
        for key, body in other.bodies.items():
            assert near(step.bodies[key].u, body.u, size=most)
        for key, obstacle in other.obstacles.items():
            assert near(step.obstacles[key].displacement, obstacle.displacement)


def test_a_part_that_is_a_secondary_twice_is_refused():
    data = blocks()
    again = {**data["contact"][0], "name": "again", "primary": "wall"}
    data |= {"contact": [data["contact"][0], again], "obstacle": [{"name": "wall"}]}
    with pytest.raises(
        InputError, match=r"^bem\.mat_type: compressed bodies in space can be secondary once"
    ) as caught:
        compressed(data)
    assert "\n" not in str(caught.value)


def test_bodies_that_do_not_fit_the_machine_together_are_refused_before_contact_is_looked_for(
    monkeypatch,
):
    monkeypatch.setattr(choice, "physical_memory", lambda: 1e6)
    monkeypatch.setattr(
        facing, "face", lambda *arguments, **keys: pytest.fail("contact is looked for")
    )
    with pytest.raises(
        InputError, match=r"^mesh: the compressed operators of all bodies take about .* GB, this"
    ):
        compressed(blocks())


def pushed_too_hard(**step):
    """A later step with more shear than friction holds on the block that only contact holds."""
    top = {"body": "free", "part": "top", "value": [0.008, 0.0, -0.01]}
    return {**on_ground(), "step": [{"name": "press"}, {"name": "push", "boundary": [top], **step}]}


def freed():
    """A block that its sides hold, until a later step frees them."""
    data = on_ground()
    sides = moved("right", [0.0, "free", "free"])
    free = {"body": "free", "part": "right", "value": ["free", "free", "free"]}
    data["body"][0]["boundary"][1]["value"] = [0.008, 0.0, -0.01]
    data["body"][0]["boundary"].append(sides)
    return {**data, "step": [{"name": "press"}, {"name": "push", "boundary": [free]}]}


@pytest.mark.parametrize(
    ("made", "told"),
    [
        (pushed_too_hard, ".*: contact can hold 0.500 of the step"),
        (freed, ""),
        # what is asked for is the load up to which it is held, on every storage
        (lambda: pushed_too_hard(increments="auto"), None),
    ],
)
def test_later_loads_that_nothing_holds_are_named_before_a_matrix_is_built(made, told, monkeypatch):
    def built(*arguments):
        raise SolverError("assemble", "a matrix is built", "")

    monkeypatch.setattr(HierarchicalBody, "__init__", built)
    held = "at the end of step 'push': body 'free' cannot be held: the load turns it beyond what"
    wanted = "a matrix is built" if told is None else held + told
    with pytest.raises(SolverError, match=wanted):
        compressed(made())


@pytest.mark.parametrize(("times", "status"), [(4.0, "converged"), (6.0, "failed")])
def test_an_elastic_residual_of_some_times_the_tolerance_is_accepted(times, status, monkeypatch):
    """Blocks hold it each by itself; five times it is reported as the failure that it may be."""
    monkeypatch.setattr(HierarchicalBody, "residual", lambda *arguments: times * 1e-4)
    data = on_ground()
    found = compressed({**data, "body": data["body"][1:]})
    assert found.status == status
    assert ("elastic residual 6.0e-04 > 0.0005" in found.reason) == (status == "failed")


MOVED = moved("top", ["0.02 - 0.01*y", "0.01*x", 0.01])
PLATE = {"geometry": cuboid([0, 0, 0], [8, 2, 0.4]), "mesh": {"element_size": 0.8, "order": 0}}


@pytest.mark.parametrize(
    ("conditions", "more", "unbalanced"),
    [
        # moved and turned as a whole: taken out of the data, so that the reaction to a small load is
        # not lost in noise
        ([MOVED], {}, False),
        ([MOVED, drawn("front", [1e-8, 0.0, 0.0])], {}, False),
        # constant elements, bent
        ([moved("left", [0.0] * 3), moved("right", [0.0, 0.0, 0.5])], PLATE, True),
    ],
)
def test_noise_of_the_compression_is_no_lack_of_equilibrium(conditions, more, unbalanced):
    body = box("one", [0, 0, 0], [2, 2, 1], 0.5, 1.0, *conditions, **more)
    found = compressed({"body": [body]}, TOLERANCE)
    assert found.converged or unbalanced
    assert any("in equilibrium" in text for text in [found.reason, *found.warnings]) == unbalanced


@pytest.mark.slow
def test_faces_that_turn_within_a_cluster_leave_the_coarse_level_regular():
    """A ring of few panels around: over a quarter of it tangents and normals sum up to one
    direction."""
    loop = outline(bottom=[0.99, 0.0], outer=[0.99, 0.6], top=[0.4, 0.6], inner=[0.4, 0.0])
    held = [moved(part, ["free", "free", 0.0]) for part in ("bottom", "top")]
    held.append(moved("inner", [0.05, 0.0, 0.0]))
    pin = box("pin", 0, 0, 0.3, 1.0, *held, geometry=loop | {"shape": "revolved"})
    contact = touching("fit", "pin.outer", "wall", gap="0.01")
    found = compressed({"body": [pin], "obstacle": [{"name": "wall"}], "contact": [contact]}, 1e-3)
    assert found.converged and max(found.last.history.ksp_iterations) <= 20


@pytest.mark.slow
def test_given_tractions_on_round_bodies_that_only_contact_holds(monkeypatch):
    """S σ took more than 2000 iterations: contact directions, which unknowns of open contact are
    along, are not the axes."""
    side = lambda part, z, r=None: {"part": part, "to": [0, z]} | ({"through": [r, 0]} if r else {})  # noqa: E731
    ball = [side("axis", -1), side("fit", 1, 1)]
    shell = [side("axis", 1), side("fit", -1, 1), side("axis", -2), side("outside", 2, 2)]
    data = {
        "body": [
            box("ball", 0, 0, 1.0, 1.0, geometry={"shape": "revolved", "loops": [ball]}),
            box("shell", 0, 0, 1.2, 3.0, geometry={"shape": "revolved", "loops": [shell]}),
        ],
        "contact": [touching("fit", "ball.fit", "shell.fit", gap=-0.01, friction_coefficient=0.3)],
    }
    for body in data["body"]:
        body["mesh"]["order"] = 0
    compressed_from(60, "hmatrix", monkeypatch)
    prepared = prepare(parse_problem({**data, "bem": {"hmatrix_tol": 1e-3}}, "test", {}, Path()))
    assert [type(body) for body in prepared.system.bodies] == [DenseBody, HierarchicalBody]
    prepared.system.operator.apply(np.random.default_rng(1).normal(size=(prepared.system.size, 3)))
    assert prepared.system.operator.iterations <= 25


@pytest.mark.parametrize("alone", [True, False])
def test_announced_memory_has_the_patches_of_both_sides(alone):
    """Before a law changes them they hold about half of what they come to."""
    data = blocks() | {"bem": {"mat_type": "hmatrix"}}
    for body in data["body"]:
        body["mesh"] = {"element_size": 0.3, "order": 1}
    if alone:
        face = {"secondary": "upper.bottom", "primary": "floor"}
        data |= {"body": data["body"][1:], "obstacle": [{"name": "floor"}]}
        data["contact"] = [data["contact"][0] | face]
    prepared = prepare(parse_problem(data, "test", {}, Path()))
    meshes = prepared.discrete.meshes
    nodes, total = choice.contact_sizes(prepared.discrete.posed, meshes)
    bem = prepared.discrete.posed.bem
    told, without = (
        choice.needed_memory(bem, meshes, *sizes, 3)
        for sizes in ((nodes, total), ([0] * len(nodes), 0))
    )
    held = prepared.system.bodies[0].joint.equations._open.nbytes
    assert held < told - without < 4 * held
