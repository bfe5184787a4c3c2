"""Load steps: what changes, one after the other; every value is reached linearly in its step."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from .base import Expression, Finite, Model


def _increments(value: Any) -> int | str:
    """One check instead of a union, whose report would name every branch."""
    if value == "auto":
        return "auto"
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 100_000:
        return value
    raise ValueError('must be a whole number from 1 to 100000, or "auto"')


Increments = Annotated[int | Literal["auto"], pydantic.BeforeValidator(_increments)]
Freedom = Annotated[float | Literal["free"], pydantic.BeforeValidator(lambda value: _freedom(value))]
"""A number, or "free"."""


def _freedom(value: Any) -> float | str:
    if value == "free":
        return "free"
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < float("inf"):
        return float(value)
    raise ValueError('must be a finite number or "free"')


class BoundaryChange(Model):
    """New values of a condition of one part.

    Attributes
    ----------
    body : str, optional
        Needed where there are several.
    part : str
        Name of the part.
    value, pressure : as in the condition
        As in the condition that it changes.
    """

    body: str | None = None
    part: str
    value: tuple[Expression, Expression] | None = None
    pressure: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> BoundaryChange:
        if (self.value is None) == (self.pressure is None):
            raise ValueError("a change needs either value = [...] or pressure = p")
        return self


class ObstacleChange(Model):
    """New values of an obstacle; what is not named stays.

    Attributes
    ----------
    name : str
        Of the obstacle.
    displacement : pair of float or "free"
        [length]
    rotation : float or "free"
        [rad]
    force : (fx, fy)
        [force/length]
    moment : float
        [force]
    """

    name: str
    displacement: tuple[Freedom, Freedom] | None = None
    rotation: Freedom | None = None
    force: tuple[Finite, Finite] | None = None
    moment: Finite | None = None


class PointForceChange(Model):
    """A new value of a point force.

    Attributes
    ----------
    name : str
        Of the point force.
    force : (fx, fy)
        [force/length]
    """

    name: str
    force: tuple[Finite, Finite]


class Step(Model):
    """One load step.

    Attributes
    ----------
    name : str
        For verdict, files and figures.
    increments : int or "auto"
        Equal increments; "auto" begins with one and halves where the solver fails or the path error is too large.
    boundary, obstacle, point_force : lists
        What changes; the rest keeps the values it has at the end of the step before.
    """

    name: str = ""
    increments: Increments = 1
    boundary: tuple[BoundaryChange, ...] = ()
    obstacle: tuple[ObstacleChange, ...] = ()
    point_force: tuple[PointForceChange, ...] = ()
