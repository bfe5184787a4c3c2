"""Several bodies and rigid obstacles, and the pairs of parts that may touch."""

from __future__ import annotations

from typing import Annotated, Any

import pydantic
import tomli_w

from .base import Coordinate, Expression, Finite, Model, Options, nearest
from .load_steps import Name, Obstacle, Step, Vector
from .mesh_options import MeshOptions
from .problem import Condition, Contact, Displacement, Geometry, Material, Normal, Traction, no_friction_if_bonded
from .solver_options import Bem, Method
from .units import Units

ONE_BODY = "body"
"""Name of the body of a file without [[body]]."""


class PointForce(Model):
    """A force at a point of the body [force/length of thickness, in space force].

    Attributes
    ----------
    at : point
        Inside the body, not on its boundary [length].
    force : (fx, fy), in space (fx, fy, fz)
        [force/length, in space force]
    name : str
        For load steps that change it.
    """

    at: Annotated[tuple[Coordinate, ...], Vector]
    force: Annotated[tuple[Finite, ...], Vector]
    name: str = ""


class Body(Model):
    """One elastic body; parts without a condition or a contact are free of traction.

    Attributes
    ----------
    name : str
        Of the body.
    material : Material
        What it is made of.
    geometry : Rectangle, Polygon, ...
        Its shape.
    mesh : MeshOptions
        Sizes, order and grading of the elements.
    boundary : list
        Conditions of its parts.
    point_force : list of PointForce
        Forces at points inside.
    """

    name: Name
    material: Material
    geometry: Geometry
    mesh: MeshOptions = MeshOptions()
    boundary: tuple[Condition, ...] = ()
    point_force: tuple[PointForce, ...] = ()

    def condition(self, part: str) -> Displacement | Traction | Contact | None:
        """The condition of a part."""
        return next((c for c in self.boundary if c.part == part), None)


class Pair(Model):
    """Two parts that may touch.

    Attributes
    ----------
    name : str
        Of the pair.
    secondary : str
        "body.part": the side whose nodes are collocated; pressure and shear live there.
    primary : str
        "body.part", or the name of an obstacle.
    normal : {"unilateral", "bilateral", "bonded"}
        May open, stays closed but may slip, or neither.
    gap : "geometry" or expression
        Initial gap [length]: the distance along the direction, or an expression in the secondary's x, y, nx, ny, s, in space
        x, y, z, nx, ny, nz. "geometry" is 0 against an obstacle, and where the contact is bilateral or bonded.
    direction : vector, optional
        From the secondary to the primary; the secondary's outward normal by default [-].
    friction_coefficient : expression, optional
        µ >= 0 of Coulomb's law |σ_t| <= µp [-].
    friction_bound : expression, optional
        g >= 0 of Tresca's law |σ_t| <= g, a cap on Coulomb's [stress]; with neither the contact is frictionless.
    """

    name: Name
    secondary: str
    primary: str
    normal: Normal = "unilateral"
    gap: Expression = "geometry"
    direction: Annotated[tuple[Finite, ...], Vector] | None = None
    friction_coefficient: Expression | None = None
    friction_bound: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _bonded_does_not_slip(self) -> Pair:
        no_friction_if_bonded(self.normal, self.friction_coefficient, self.friction_bound)
        return self

    @pydantic.field_validator("direction")
    @classmethod
    def _points_somewhere(cls, value: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if value is not None and not 1e-300 < sum(component**2 for component in value) < 1e300:
            raise ValueError("must be a vector other than zero")
        return value


class Assembly(Model):
    """A contact problem of several bodies, and how it is solved: one TOML file with [[body]].

    Attributes
    ----------
    title : str
        Of the problem, for verdict and figures.
    units : Units
        Names of the units, for figures and files.
    body : list of Body
        The elastic bodies.
    obstacle : list of Obstacle
        Rigid bodies.
    contact : list of Pair
        Which parts may touch.
    step : list of Step
        Load steps, in order; without them the loads are applied in one.
    method : Method
        How the contact problem is solved.
    bem : Bem
        How the boundary operators are stored.
    petsc : dict
        PETSc options without the leading dash; `-options_file` and the command line have precedence.
    """

    title: str = ""
    units: Units = Units()
    body: Annotated[tuple[Body, ...], pydantic.Field(min_length=1)]
    obstacle: tuple[Obstacle, ...] = ()
    contact: tuple[Pair, ...] = ()
    step: tuple[Step, ...] = ()
    method: Method = Method()
    bem: Bem = Bem()
    petsc: Options = {}  # noqa: RUF012 (pydantic copies it)

    @pydantic.model_validator(mode="after")
    def _names_exist(self) -> Assembly:
        _distinct("body", [body.name for body in self.body])
        _distinct("obstacle", [o.name for o in self.obstacle])
        _distinct("contact", [pair.name for pair in self.contact])
        bodies, obstacles = [body.name for body in self.body], [o.name for o in self.obstacle]
        for name in set(bodies) & set(obstacles):
            raise ValueError(f"obstacle: the name {name!r} is that of a body already")
        stated = dict[frozenset[object], str]()
        for k, pair in enumerate(self.contact):
            here = self.side(f"contact[{k}].secondary", pair.secondary)
            there: object = pair.primary
            if there not in obstacles:
                there = self.side(f"contact[{k}].primary", pair.primary, obstacles)
            if here == there:
                raise ValueError(f"contact[{k}].primary: {pair.primary!r} is the secondary side itself")
            first = stated.setdefault(frozenset((here, there)), pair.name)
            if first != pair.name:
                raise ValueError(f"contact[{k}]: {pair.secondary!r} and {pair.primary!r} are in contact already, "
                                 f"as {first!r}; each would carry a part of the pressure")  # fmt: skip
        for k, step in enumerate(self.step):
            self._check_step(f"step[{k}]", step, bodies, obstacles)
        return self

    def side(self, key: str, text: str, obstacles: list[str] = []) -> tuple[int, str]:  # noqa: B006 (read only)
        """Number of the body and name of the part that "body.part" means; of a single body "part" will do."""
        bodies = [body.name for body in self.body]
        name, dot, part = text.partition(".")
        if not dot and len(bodies) == 1 and text not in bodies:
            name, dot, part = bodies[0], ".", text
        if name not in bodies or not part:
            what = 'must be "body.part"' + (" or the name of an obstacle" if obstacles else "")
            names = [*(f"{body}.…" for body in bodies), *obstacles]
            hint = nearest(name, [*bodies, *obstacles]) or f"; there are {', '.join(names)}"
            raise ValueError(f"{key}: {what}, got {text!r}{hint}")
        return bodies.index(name), part

    def _check_step(self, key: str, step: Step, bodies: list[str], obstacles: list[str]) -> None:
        for k, change in enumerate(step.boundary):
            here = f"{key}.boundary[{k}]"
            if change.body is None and len(bodies) > 1:
                raise ValueError(f"{here}.body: this key is required where there are several bodies")
            name = change.body or bodies[0]
            if name not in bodies:
                hint = nearest(name, bodies) or f"; bodies are {', '.join(bodies)}"
                raise ValueError(f"{here}.body: no body {name!r}{hint}")
            changed_condition(self.body[bodies.index(name)], change, here)
        for k, other in enumerate(step.obstacle):
            if other.name not in obstacles:
                hint = nearest(other.name, obstacles) or "; obstacles are " + (", ".join(obstacles) or "none")
                raise ValueError(f"{key}.obstacle[{k}].name: no obstacle {other.name!r}{hint}")
        forces = [force.name for body in self.body for force in body.point_force if force.name]
        for k, force in enumerate(step.point_force):
            if force.name not in forces:
                hint = nearest(force.name, forces) or "; point forces with a name are " + (", ".join(forces) or "none")
                raise ValueError(f"{key}.point_force[{k}].name: no point force {force.name!r}{hint}")

    def conditions(self, number: int) -> list[dict[str, Displacement | Traction]]:
        """Conditions of a body by part at the end of each step (of one, where there are none); what a step leaves alone
        stays the same object."""
        body, names = self.body[number], [body.name for body in self.body]
        known = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
        result = []
        for s, step in enumerate(self.step or (None,)):
            for k, change in enumerate(step.boundary if step else ()):
                if (change.body or names[0]) == body.name:
                    now = body.model_copy(update={"boundary": tuple(known.values())})
                    known = {**known, change.part: changed_condition(now, change, f"step[{s}].boundary[{k}]")}
            result.append(known)
        return result

    def point_forces(self, number: int, step: int, factor: float) -> list[PointForce]:
        """Point forces of a body at a load factor of a step (from 1), linear from the end of the step before."""
        last = [f.model_copy(update={"force": (0.0,) * len(f.force)}) for f in self.body[number].point_force]
        wanted = list(self.body[number].point_force)
        for k in range(1, step + 1):
            changes = {change.name: change.force for change in (self.step[k - 1].point_force if self.step else ())}
            wanted = [f.model_copy(update={"force": changes.get(f.name, f.force)}) for f in wanted]
            share = factor if k == step else 1.0
            reached = [tuple((1.0 - share) * a + share * b for a, b in zip(x.force, y.force, strict=True))
                       for x, y in zip(last, wanted, strict=True)]  # fmt: skip
            last = [f.model_copy(update={"force": force}) for f, force in zip(wanted, reached, strict=True)]
        return last

    def toml(self) -> str:
        """The whole assembly as TOML, defaults filled in."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


def changed_condition(body: Body, change: Any, key: str) -> Displacement | Traction:
    """The condition of a part with the values of a step.

    Raises
    ------
    ValueError
        If the part has no such condition, or it would become another kind.
    """
    old = body.condition(change.part)
    if old is None or isinstance(old, Contact):
        names = [c.part for c in body.boundary if not isinstance(c, Contact)]
        hint = nearest(change.part, names) or f"; those of body {body.name!r} are {', '.join(names) or 'none'}"
        raise ValueError(f"{key}.part: no displacement or traction condition on {change.part!r}{hint}")
    if isinstance(old, Traction):
        return Traction(part=old.part, value=change.value, pressure=change.pressure)
    if change.pressure is not None:
        raise ValueError(f"{key}.pressure: the condition of {change.part!r} is a displacement, give value = [ux, uy]")
    if len(change.value) != len(old.value):
        raise ValueError(f"{key}.value: the condition of {change.part!r} has {len(old.value)} components, "
                         f"got {len(change.value)}")  # fmt: skip
    return Displacement(part=old.part, value=change.value)


def _distinct(key: str, names: list[str]) -> None:
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ValueError(f"{key}[{k}].name: {name!r} is taken already")


def assembly_of(case: Any) -> Assembly:
    """A one-body case as an assembly of one body, whose contact conditions face fixed rigid obstacles; or an assembly."""
    if isinstance(case, Assembly):
        return case
    body = Body(name=ONE_BODY, material=case.material, geometry=case.geometry, mesh=case.mesh, boundary=case.boundary)
    return Assembly(title=case.title, units=case.units, body=(body,), step=case.step, method=case.method, bem=case.bem,
                    petsc=case.petsc)  # fmt: skip


__all__ = ["ONE_BODY", "Assembly", "Body", "Obstacle", "Pair", "PointForce", "assembly_of", "changed_condition"]
