"""Grids of elements as Abaqus and CalculiX write them, and the problem of a file."""

from __future__ import annotations

import itertools

import numpy as np

from petcontact.convert.inp_problem import convert_inp
from petcontact.model.case import parse_problem
from petcontact.model.toml_text import parse_toml


def grid(lower, upper, counts, first_node, first_element, kind, elset):
    """*NODE and *ELEMENT of a grid of squares or cubes, and its nodes by place."""
    d = len(counts)
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, counts, strict=True)]
    places = list(itertools.product(*(range(n + 1) for n in counts)))
    number = {place: first_node + k for k, place in enumerate(places)}
    text = ["*NODE"]
    text += [
        f"{number[p]}, " + ", ".join(f"{lines[c][p[c]]:.12g}" for c in range(d)) for p in places
    ]
    text.append(f"*Element, type={kind}, elset={elset}")
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    order = ring if d == 2 else [(*xy, z) for z in (0, 1) for xy in ring]
    for k, cell in enumerate(itertools.product(*(range(n) for n in counts))):
        nodes = [
            number[tuple(a + b for a, b in zip(cell, corner, strict=True))] for corner in order
        ]
        text.append(f"{first_element + k}, {', '.join(map(str, nodes))}")
    return text, number


def sets(name, number, axis, at):
    """*NSET of the nodes of a face of the grid."""
    chosen = [node for place, node in number.items() if place[axis] == at]
    return [
        f"*NSET, NSET={name}",
        *(", ".join(map(str, chosen[k : k + 8])) for k in range(0, len(chosen), 8)),
    ]


def converted(folder, text):
    """The problem of an input file, and what was not taken."""
    (folder / "deck.inp").write_text(text)
    found = convert_inp(folder / "deck.inp", "deck")
    for name, mesh in found.meshes.items():
        (folder / name).write_text(mesh)
    return parse_problem(parse_toml(found.toml, "deck"), "deck", {}, folder), found.notes
