"""What configs of tests consist of, as the tables that `parse` takes."""

from __future__ import annotations

from typing import Any

from petcontact import Problem
from petcontact.given.tables.base import parse


def elastic(young_modulus: float, poisson_ratio: float) -> dict[str, float]:
    """A material."""
    return {"young_modulus": young_modulus, "poisson_ratio": poisson_ratio}


def rectangle(lower_left: Any, upper_right: Any) -> dict[str, Any]:
    """A geometry of the plane."""
    return {"shape": "rectangle", "lower_left": lower_left, "upper_right": upper_right}


def cuboid(lower: Any, upper: Any) -> dict[str, Any]:
    """A geometry in space."""
    return {"shape": "box", "lower": lower, "upper": upper}


def outline(**ends: Any) -> dict[str, Any]:
    """A geometry of the plane: sides by their ends (x, y), arcs by end and radius (x, y, r)."""
    sides = [
        {"part": part, "to": end[:2]} | ({"radius": end[2]} if len(end) > 2 else {})
        for part, end in ends.items()
    ]
    return {"shape": "outline", "loops": [sides]}


def moved(part: str, value: Any) -> dict[str, Any]:
    """A part whose displacement is given."""
    return {"part": part, "condition": "displacement", "value": value}


def drawn(part: str, value: Any) -> dict[str, Any]:
    """A part whose traction is given."""
    return {"part": part, "condition": "traction", "value": value}


def touching(name: str, secondary: str, primary: str, **more: Any) -> dict[str, Any]:
    """A pair of parts in contact."""
    return {"name": name, "secondary": secondary, "primary": primary, **more}


def solid(name: str, geometry: dict[str, Any], *boundary: dict[str, Any], **more: Any) -> dict:
    """A body; its material has the modulus 1 and the ratio 0.3 unless it is given."""
    body = {"name": name, "material": elastic(1.0, 0.3), "geometry": geometry}
    return {**body, "boundary": list(boundary), **more}


def problem(**tables: Any) -> Problem:
    """The problem of such tables."""
    return parse(Problem, tables, "test")


def closing(part: str, **law: Any) -> dict[str, Any]:
    """A part in contact with a rigid foundation, bilateral unless `normal` says so."""
    return {"part": part, "condition": "contact", **law}


def rollers(*parts: str) -> list[dict[str, Any]]:
    """Planes of symmetry."""
    return [{"part": part, "condition": "symmetry"} for part in parts]
