"""Torsion of bodies of revolution: whether a problem has it, and vectors with a third component."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..given.posed import HOLD
from ..given.tables.base import Model
from ..untyped import Keyed
from .bodies import Displacement, Periodic, Traction
from .load_steps import BoundaryChange, ObstacleChange, PointForceChange
from .loads import PointForce
from .obstacles import Obstacle
from .setting import Bodies

VECTORS: dict[type[Model], tuple[str, ...]] = {
    Traction: ("value",),
    Displacement: ("value", "traction"),
    BoundaryChange: ("value", "traction", "by"),
    **dict.fromkeys((PointForce, PointForceChange), ("force",)),
    Obstacle: ("displacement", "force"),
    ObstacleChange: ("displacement", "force", "by"),
}
"""Keys of vectors that may have a component round the axis, by the model that has them."""
STILL = (None, 0.0, "free", HOLD, (), (0.0,), ("free",), (HOLD,))
"""Values of the rotation and the moment of an obstacle that turn nothing."""


def is_twisted(problem: Bodies) -> bool:
    """Whether something turns bodies of revolution about their axis: a vector with a third
    component, a rotation or a moment."""
    if problem.symmetry != "axial":
        return False
    for model in _models(problem):
        if any(len(_vector(model, key)) == 3 for key in VECTORS.get(type(model), ())):
            return True
        if isinstance(model, Obstacle | ObstacleChange) and not (
            model.rotation in STILL and model.moment in STILL
        ):
            return True
    return False


def with_third_components(problem: Bodies) -> Keyed:
    """Bodies, obstacles and steps of a problem with torsion; a third component that is not given
    is 0."""
    jumps = {c.part for body in problem.body for c in body.boundary if isinstance(c, Periodic)}

    def whole(model: Model) -> Model:
        keys = () if getattr(model, "part", None) in jumps else VECTORS.get(type(model), ())
        new = {key: (*_vector(model, key), 0.0) for key in keys if len(_vector(model, key)) == 2}
        return model.model_copy(update=new) if new else model

    def each(owner: Any, *keys: str) -> object:
        return owner.model_copy(update={k: tuple(map(whole, getattr(owner, k))) for k in keys})

    return {
        "body": tuple(each(body, "boundary", "point_force") for body in problem.body),
        "obstacle": tuple(map(whole, problem.obstacle)),
        "step": tuple(each(step, "boundary", "obstacle", "point_force") for step in problem.step),
    }


def _models(problem: Bodies) -> Iterator[Model]:
    """Yield the tables of the config whose values may twist a body."""
    yield from problem.obstacle
    for body in problem.body:
        yield from (*body.boundary, *body.point_force)
    for step in problem.step:
        yield from (*step.boundary, *step.obstacle, *step.point_force)


def _vector(model: Model, key: str) -> tuple[object, ...]:
    """A vector that is given by its components, else none."""
    value = getattr(model, key)
    return value if isinstance(value, tuple) else ()
