"""Of an input file: loads that a step renews, temperatures, and nodes that are held one by one."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array
from ..given.posed import HOLD
from ..round_off import TINY
from .inp_keywords import Keyword

SCALED = {"BOUNDARY": 3, "CLOAD": 2, "DLOAD": 2, "DSLOAD": 2, "TEMPERATURE": 1}
"""Which word of a line an amplitude scales."""
NOT_TURNED = "*TRANSFORM of {}: turned axes are not taken; it is held along x, y and z"


def gather(read: Any) -> None:
    """Make sets of the nodes that are held one by one in the same way."""
    alike: dict[tuple[int, tuple[float | str | None, ...]], list[int]] = {}
    for word in [word for word in read.held[-1] if word.isdecimal()]:
        steps = [step.pop(word, {}) for step in read.held]
        for freedom in sorted({freedom for step in steps for freedom in step}):
            through = tuple(step.get(freedom) for step in steps)
            alike.setdefault((freedom, through), []).append(int(word))
    for (freedom, through), nodes in alike.items():
        name = next(
            name
            for name in (f"NODES{k}" for k in itertools.count(1))
            if name not in read.file.nsets
        )
        read.file.nsets[name] = nodes
        for step, value in zip(read.held, through, strict=True):
            step[name] = {} if value is None else {freedom: value}


def turn(read: Any) -> None:
    """Take forces at nodes of turned axes along x, y and z; find the sets that one of these axes
    holds, and note others that are held along them."""
    axes, file = _axes(read), read.file
    for step in read.forces:
        for node in {node for node, _ in step} & axes.keys():
            force = axes[node].T @ [step.pop((node, c), 0.0) for c in (1, 2, 3)]
            step |= {(node, c): value for c, value in enumerate(force, 1)}
    for name in read.held[-1]:
        if axes.keys() & {*file.members(name)}:
            _turn_held(read, name, axes)


def _turn_held(read: Any, name: str, axes: dict[int, Array]) -> None:
    """Take a set that is held along one of its axes for good; note others than those of which
    nothing moves."""
    values = read.held[-1][name]
    still = {freedom for freedom, value in values.items() if value in (0.0, HOLD)}
    solid = next(iter(read.file.elements.values()))[0].startswith("C3D")
    if still == values.keys() and still.issuperset((1, 2, 3) if solid else (1, 2)):
        return
    if len(values) == len(still) == 1 and all(step.get(name) == values for step in read.held):
        (freedom,) = values
        own = {*read.file.members(name)} & axes.keys()
        read.rollers[name] = {node: axes[node][freedom - 1] for node in own}
    else:
        read.notes.append(NOT_TURNED.format(name))


def _axes(read: Any) -> dict[int, Array]:
    """Return the turned axes of nodes, a row each: of a plane, or round, along and up an axis."""
    axes = dict[int, Array]()
    for keyword in [keyword for keyword in read.file.rest if keyword.name == "TRANSFORM"]:
        numbers = read.floats(keyword, ([*keyword.rows, []][0] + [""] * 6)[:6])
        a, b = np.reshape(numbers, (2, 3))
        for node in read.file.members(keyword.parameters.get("NSET", "")):
            out, up = a, np.cross(a, b)
            if keyword.parameters.get("TYPE", "R").upper() == "C":
                out, up = read.file.nodes[node] - a, b - a
            beside = np.cross(up, out)
            ways = np.array([np.cross(beside, up), beside, up])
            axes[node] = ways / np.maximum(np.linalg.norm(ways, axis=1), TINY)[:, None]
    return axes


def renew(read: Any, keyword: Keyword) -> None:
    """Take away what was held or loaded before a step if its first keyword of a kind has OP=NEW:
    boundarys.f of CalculiX, where conditions of the model are no exception."""
    kind = keyword.name.replace("DSLOAD", "DLOAD")
    first = (len(read.steps), kind) not in read.renewed
    read.renewed.add((len(read.steps), kind))
    if keyword.parameters.get("OP", "").upper() != "NEW" or not first or not read.steps:
        return
    if kind == "BOUNDARY":
        read.held[-1] = {name: {} for name in read.held[-1] if len(read.held) > 1}
    elif kind == "TEMPERATURE":
        read.warmed[-1] = {}
    elif kind == "DLOAD":
        read.pressing.clear()
    for states in read.added.get(kind, ()):
        states[-1] = {key: 0.0 * load for step in states for key, load in step.items()}


def at_end(read: Any, keyword: Keyword) -> Keyword:
    """Return a load with the value that its amplitude gives it at the end of the step."""
    name, column = keyword.parameters.get("AMPLITUDE", "").upper(), SCALED.get(keyword.name)
    if not name or column is None:
        return keyword
    end = _share(read, keyword, name)
    rows = [
        [f"{float(word) * end!r}" if k == column else word for k, word in enumerate(row)]
        for row in keyword.rows
    ]
    return replace(keyword, rows=rows)


def _share(read: Any, keyword: Keyword, name: str) -> float:
    """Return the value of an amplitude at the end of the step; note where its way bends."""
    named = [
        one
        for one in read.file.rest
        if one.name == "AMPLITUDE" and one.parameters.get("NAME", "").upper() == name
    ]
    rows = [read.floats(one, row) for one in named for row in one.rows]
    points = [value for row in rows for value in row]
    if len(points) < 2:
        raise read.error(keyword, f"there is no *AMPLITUDE {name} of times and values")
    time, share = points[::2], points[1 : 2 * (len(points) // 2) : 2]
    begin = read.begin * (named[0].parameters.get("TIME", "").upper() == "TOTAL TIME")
    passed = np.array([0.0, *(t - begin for t in time if 0.0 < t - begin < read.period)])
    end, *way = np.interp(begin + np.array([read.period, *passed]), time, share)
    start = way[0] * (begin > 0.0)
    straight = start + (end - start) * passed / read.period
    if not (np.allclose(way, end) or np.allclose(way, straight)):
        read.note(keyword, f"AMPLITUDE={name}: its value at the end of the step; the way is linear")
    return float(end)


def read_temperature(read: Any, keyword: Keyword) -> None:
    """Read temperatures of nodes, and those without strain."""
    first = keyword.name == "INITIAL CONDITIONS"
    if first and keyword.parameters.get("TYPE", "").upper() != "TEMPERATURE":
        read.note(keyword, f"TYPE={keyword.parameters.get('TYPE', '')}; not taken")
        return
    if not keyword.rows:
        read.note(keyword, "temperatures of a file of results; not taken")
    for row in keyword.rows:
        nodes, value = read.file.members(row[0]), read.floats(keyword, row[1:2])[0]
        (read.initial if first else read.warmed[-1]).update(dict.fromkeys(nodes, value))
