"""Sweeps of format 1: a result file a case, `cases/ID.h5`, and copies of them in results.h5. Read, never written."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import PetcontactError, ResultError
from ...model.base import parse
from ...model.problem import Problem
from ...results.format.container import opened
from ...results.solution import Solution, read_solution
from ..published import published_count
from ..quantities import row_of
from .journal import Row

FINISHED = ("converged", "not converged")


def read_rows(path: Path, index: dict[str, Any]) -> Iterator[Row]:
    """A row a case, from its attributes: of a folder, or of its results.h5."""
    entries = index["cases"]
    if path.is_dir():
        for entry in entries:
            attributes: dict[str, Any] | None = None
            if (case := path / "cases" / f"{entry['id']}.h5").is_file():
                with opened(case) as file:
                    attributes = dict(file.attrs)
            yield _row(entry, attributes)
        return
    with opened(path) as file:
        for entry in entries:
            yield _row(entry, dict(file[entry["id"]].attrs) if entry["id"] in file else None)


def _row(entry: dict[str, Any], attributes: dict[str, Any] | None) -> Row:
    head = {"id": entry["id"], **entry["coordinates"]}
    if attributes is None:
        return {**head, "status": "missing", "reason": ""}
    try:
        case: Problem = parse(Problem, tomllib.loads(attributes["config"]), entry["id"])
        names = {"final_rho": "rho", **{name: name for name in ("iterations", "residual", "elastic_residual")}}
        known: dict[str, Any] = {name: attributes.get(key) for name, key in names.items()}
        plain = {name: value.item() if hasattr(value, "item") else value for name, value in known.items()}
        seconds = json.loads(attributes.get("timings", "{}")).get("iterate")
        return {**head, "status": str(attributes["status"]), "published": published_count(case), **plain,
                "iterate_seconds": seconds, "reason": str(attributes["reason"])}  # fmt: skip
    except (KeyError, ValueError) as error:
        raise ResultError(f"{entry['id']}: not a case of a sweep ({error})") from None


def adopted(folder: Path, id_: str, case: Problem, coordinates: dict[str, Any]) -> Row | None:
    """The row of a finished case of format 1 that can be used again: whole, finite, of the same config; None otherwise."""
    name = f"cases/{id_}.h5"
    if not (folder / name).is_file():
        return None
    try:
        solution = read_solution(folder / name)
        same = solution.case.toml() == case.toml() and solution.status in FINISHED
        if not (same and sound(solution)):
            return None
        return {**row_of(id_, coordinates, solution), "fields": name}
    except (PetcontactError, ValueError, IndexError, OSError):
        return None


def sound(solution: Solution) -> bool:
    """Whether fields are finite and of the shapes that belong together."""
    n, m = solution.mesh.n_nodes, len(solution.contact.nodes)
    c = solution.contact
    shapes = (
        len(solution.u) == len(solution.traction) == n
        and {m} == {len(v) for v in (c.x, c.tangent, c.weight, c.u_t, c.sigma_t, c.sigma_n, c.friction_bound, c.state)}
        and m > 0 and c.nodes.min() >= 0 and c.nodes.max() < n
    )  # fmt: skip
    return bool(shapes) and all(
        values.dtype.kind == "f" and np.isfinite(values).all()
        for values in (solution.u, solution.traction, c.x, c.weight, c.u_t, c.sigma_t, c.sigma_n, c.friction_bound)
    )
