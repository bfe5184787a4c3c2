"""Of an input file: loads that a step renews, temperatures, and nodes that are held one by one."""

from __future__ import annotations

import itertools
from typing import Any

from .inp_file import Keyword


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


def renew(read: Any, keyword: Keyword) -> None:
    """Take away what earlier steps held or loaded, at the first OP=NEW of a kind in a step."""
    kind = keyword.name.replace("DSLOAD", "DLOAD")
    first = (len(read.steps), kind) not in read.renewed
    if keyword.parameters.get("OP", "").upper() != "NEW" or not first or len(read.steps) < 2:
        return
    read.renewed.add((len(read.steps), kind))
    if kind == "BOUNDARY":
        read.held[-1] = {name: {} for name in read.held[-1]}
    elif kind == "DLOAD":
        read.pressed[-1], read.volume[-1] = {}, {}
    elif kind == "CLOAD":
        read.forces[-1] = {key: 0.0 for step in read.forces for key in step}
    elif kind == "TEMPERATURE":
        read.warmed[-1] = {}


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
