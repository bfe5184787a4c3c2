"""What meshes leave of known data, which they see at their nodes only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...arrays import Array
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.expressions import Value, evaluate
from ...model.problem import Problem
from ...refinement.known_data import given_data

SAMPLES = {2: 16, 3: 6}
"""By the dimension: places along each direction of an element."""
LARGE = 0.25
"""Share of known data between the nodes that is warned of: constant elements leave 16 % of a sine
at ten a period."""


def missed_data(problem: Problem, meshes: Mapping[str, BoundaryMesh]) -> list[str]:
    """Known data of which a mesh misses a large share, in words.

    It is the integral of |f - f_h| over that of |f|, f_h the polynomials through the values at the
    nodes.

    Examples
    --------
    >>> missed_data(problem, solution.meshes)
    ["body 'body': its mesh misses 97 % of the traction on left, which varies within elements; use
    smaller elements there"]
    """
    found = dict[str, float]()
    for number, part, what, value in _given(problem):
        if isinstance(value, str) or callable(value):
            name = problem.body[number].name
            text = f"body {name!r}: its mesh misses {{:.0%}} of the {what} on {part}"
            found[text] = max(found.get(text, 0.0), _missed(meshes[name], part, value))
    why = ", which varies within elements; use smaller elements there"
    return [f"{text.format(share)}{why}" for text, share in found.items() if share > LARGE]


def _given(problem: Problem) -> Iterator[tuple[int, str, str, Value]]:
    """Body, part and kind of all that conditions, also those of steps, and friction give."""
    for number in range(len(problem.body)):
        for of_step in problem.conditions(number):
            for part, condition in of_step.items():
                for what, values, _ in given_data(condition):
                    yield from ((number, part, what, value) for value in values)
    for side in problem.interfaces:
        for what in ("friction_bound", "friction_coefficient"):
            value = getattr(side.law, what)
            if value is not None:
                yield side.body, side.part, what.replace("_", " "), value


def _missed(mesh: BoundaryMesh, part: str, value: Value) -> float:
    """What the mesh misses of one of them, relative to all of it [-]."""
    elements, faces = mesh.faces(part)
    line = (np.arange(SAMPLES[mesh.dim]) + 0.5) / SAMPLES[mesh.dim]
    one = np.stack(np.meshgrid(*[line] * (mesh.dim - 1)), axis=-1).reshape(-1, mesh.dim - 1)
    place = faces.spread(
        np.repeat(np.arange(len(elements)), len(one)), np.tile(one, (len(elements), 1))
    )
    element, nodes = np.repeat(elements, len(one)), mesh.nodes_of(part)
    at_nodes = np.zeros(mesh.n_nodes)
    at_nodes[nodes] = _finite(value, mesh.variables(nodes), len(nodes))
    exact = _finite(value, mesh.variables_at(element, place), len(element))
    area = np.bincount(mesh.element, mesh.weight, mesh.n_elements)[element]
    whole = float(area @ np.abs(exact))
    return (
        float(area @ np.abs(exact - mesh.basis_at(element, place) @ at_nodes)) / whole
        if whole
        else 0.0
    )


def _finite(value: Value, names: Mapping[str, Array], count: int) -> Array:
    """Values, 0 where they are not finite."""
    return np.nan_to_num(evaluate(value, names, count, "", finite=False), posinf=0.0, neginf=0.0)
