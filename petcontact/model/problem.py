"""The problem: bodies, obstacles, contacts, load steps, and how it is solved. A file of one body is
a spelling of it."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, Self

import pydantic
import tomli_w

from ..errors import ONE_BODY, InputError, in_body
from ..geometry.condensed_surface import CondensedSurface
from ..geometry.meridian import meridian
from ..geometry.outline import as_outline
from ..geometry.surface import Boundary
from ..given import body_data, posed
from ..given.interface_data import PosedInterface
from ..given.posed import Posed
from ..given.tables.base import Model
from ..given.tables.material import Material
from ..given.tables.solver_options import Bem, MeshOptions, Method
from ..given.tables.units import Units
from .bodies import (
    Body,
    Condition,
    Contact,
    Displacement,
    Geometry,
    Normal,
    Pair,
    Periodic,
    Symmetry,
    Traction,
)
from .cycle import Cycle, check_cycle, cycle_steps
from .description import html_table, summary
from .interfaces import check_pairs, posed_interfaces, within_reach
from .load_steps import Step, changed_condition, changed_obstacles, check_step, check_until
from .loads import PointForce, VolumeLoads, check_material
from .obstacles import Obstacle
from .posed_bodies import posed_body
from .setting import Bodies, Setting
from .shapes.files import Gmsh
from .shapes.plane import SideBySide
from .torsion import is_twisted, with_third_components

if TYPE_CHECKING:
    from ..geometry.surface import Boundary


class OneBody(Setting):
    """A contact problem of one body, which stands at the top of the file, and how it is solved.

    Attributes
    ----------
    material : Material
        What the body is made of.
    geometry : Rectangle, Polygon, ...
        Its shape.
    mesh : MeshOptions
        Sizes, order and grading of the elements.
    boundary : list
        Conditions of its parts; required where there is no [[contact]].
    point_force : list of PointForce
        Forces at points inside.
    loads : VolumeLoads
        Weight, rotation, temperature and other loads of the volume.
    """

    material: Material = pydantic.Field(kw_only=True)
    geometry: Geometry = pydantic.Field(kw_only=True)
    mesh: MeshOptions = MeshOptions.model_construct()
    boundary: tuple[Condition, ...] = ()
    point_force: tuple[PointForce, ...] = ()
    loads: VolumeLoads | None = None


OWN = tuple(name for name in OneBody.model_fields if name not in Setting.model_fields)
"""Keys of the one body of a file without [[body]]."""
HOW = {"method", "bem", "petsc"}
"""Keys that say how a problem is solved, from which nothing of what is solved follows."""


class Problem(Bodies):
    """A contact problem of several bodies, and how it is solved: one TOML file with [[body]].

    A problem of one body may be given and read without its `Body`: by `material`, `geometry`,
    `mesh`, `boundary`, `point_force` and `loads` of its own. The body is called "body" then.

    Attributes
    ----------
    body : list of Body
        The elastic bodies.
    title : str
        What the problem is called.
    symmetry : {"plane", "axial"}
        "axial" for bodies of revolution.
    units : Units
        Names of units.
    obstacle : list of Obstacle
        Rigid bodies.
    contact : list of Pair
        Which parts may touch.
    step : list of Step
        Load steps, in order; without them the loads are applied in one.
    cycle : Cycle, optional
        Steps that are done again and again.
    method, bem, petsc : optional
        How the contact problem is solved, how operators are stored, and PETSc options.

    Raises
    ------
    InputError
        One line: the key as it was given, what was given, what is allowed.

    Examples
    --------
    >>> from petcontact import Contact, Displacement, Material, Problem, Rectangle
    >>> block = Problem(
    ...     material=Material(1e4, 0.3), geometry=Rectangle((0, 0), (8, 4)),
    ...     boundary=[Contact("bottom", friction_bound=150), Displacement("top", (0, 0))],
    ... )
    >>> block.body[0].name, block.material.young_modulus
    ('body', 10000.0)
    """

    _others = OWN

    if TYPE_CHECKING:

        def __init__(
            self,
            title: str = ...,
            *,
            symmetry: Literal["plane", "axial"] | None = ...,
            units: Units = ...,
            body: Sequence[Body] = ...,
            material: Material = ...,
            geometry: Geometry = ...,
            mesh: MeshOptions = ...,
            boundary: Sequence[Condition] = ...,
            point_force: Sequence[PointForce] = ...,
            loads: VolumeLoads | None = ...,
            obstacle: Sequence[Obstacle] = ...,
            contact: Sequence[Pair] = ...,
            step: Sequence[Step] = ...,
            cycle: Cycle | None = ...,
            method: Method = ...,
            bem: Bem = ...,
            petsc: Mapping[str, object] = ...,
        ) -> None: ...

    @classmethod
    def spelling(cls, data: object) -> type[Model]:
        """Return the class whose keys the data have: `OneBody` where no word for [[body]] is."""
        return OneBody if isinstance(data, dict) and not {"body", "bodies"} & data.keys() else cls

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _with_bodies(
        cls, data: object, build: pydantic.ModelWrapValidatorHandler[Problem]
    ) -> Problem:
        """What is said of one body moved into a [[body]]; where that is refused, `OneBody` names
        keys as they were given."""
        if not isinstance(data, dict):
            return build(data)
        if "body" in data:
            for key in filter(data.__contains__, OWN):
                raise ValueError(
                    f"{key}: belongs to a body; where there is [[body]] it stands in each of them"
                )
            return build(data)
        body = {"name": ONE_BODY, **{name: value for name, value in data.items() if name in OWN}}
        try:
            if not data.keys() & {"boundary", "contact"}:
                raise InputError("boundary: this key is required")
            return build(
                {
                    **{name: value for name, value in data.items() if name not in OWN},
                    "body": (body,),
                }
            )
        except ValueError:
            OneBody.model_validate(data)
            raise

    @functools.cached_property
    def twisted(self) -> bool:
        """Whether bodies of revolution turn about their axis."""
        return is_twisted(self)

    @pydantic.model_validator(mode="after")
    def _bodies_of_revolution(self) -> Problem:
        if self.twisted:
            self.__dict__.update(with_third_components(self))
        if self.symmetry != "axial":
            return self
        for k, body in enumerate(self.body):
            if body.material.plane == "stress":
                key = "material" if self.is_flat else f"body[{k}].material"
                raise ValueError(f'{key}.plane: a body of revolution is no plate, got "stress"')
            if body.geometry.shape in ("rectangle", "polygon", "outline"):
                parts = self.outline(k).parts
                for j, condition in enumerate(body.boundary):
                    # of a name that no side has at all the interfaces tell
                    if condition.part in {*body.geometry.outline().parts} - {*parts}:
                        place = "" if self.is_flat else f"body[{k}]."
                        raise ValueError(
                            f"{place}boundary[{j}].part: {condition.part!r} lies on the axis x = "
                            f"0, which takes no condition; parts are {', '.join(parts)}"
                        )
        return self

    @pydantic.model_validator(mode="after")
    def _names_exist(self) -> Problem:
        _distinct("body", [body.name for body in self.body])
        _distinct("obstacle", [o.name for o in self.obstacle])
        _distinct("contact", [pair.name for pair in self.contact])
        bodies, obstacles = [body.name for body in self.body], [o.name for o in self.obstacle]
        for name in set(bodies) & set(obstacles):
            raise ValueError(f"obstacle: the name {name!r} is that of a body already")
        check_pairs(self)
        for k, body in enumerate(self.body):
            if body.loads is not None:
                check_material("loads" if self.is_flat else f"body[{k}].loads", body, body.loads)
        for k, step in enumerate(self.step):
            check_step(f"step[{k}]", step, self.body, obstacles)
        friction = [law.has_friction for side in posed_interfaces(self) for law in side.laws]
        if self.cycle is not None:
            check_cycle(self, self.cycle)
        check_until(self.step, friction, cycle_steps(self))
        return self

    @pydantic.model_validator(mode="after")
    def _one_thickness(self) -> Problem:
        """Forces are whole ones in all bodies, or per length in all."""
        given = [body.material.thickness is not None for body in self.body]
        if any(given) and (self.symmetry == "axial" or not all(given)):
            k = given.index(self.symmetry == "axial")
            raise InputError(
                f"{'' if self.is_flat else f'body[{k}].'}material.thickness: "
                + (
                    "a body of revolution has none"
                    if self.symmetry == "axial"
                    else "give it to all bodies, or to none; forces are per length without it"
                )
            )
        return self

    def outline(self, number: int = 0) -> Boundary:
        """The boundary of a body: of its shape, or of what this generates by revolution.

        Raises
        ------
        InputError
            If the shape has none, or with `symmetry = "axial"` is no half section.
        """
        body, axial = self.body[number], self.symmetry == "axial"
        place = "geometry.file: " * hasattr(body.geometry, "file")
        try:
            boundary: Boundary = (
                body.geometry.outline(axial)
                if isinstance(body.geometry, Gmsh | SideBySide)
                else body.geometry.outline()
            )
            place = ""
            if (thickness := body.material.thickness) is not None:
                return as_outline(boundary, "material.thickness").of_thickness(thickness)
            if isinstance(boundary, CondensedSurface):
                boundary.demand(axial, self.twisted)
                return boundary
            if self.symmetry is None:
                return boundary
            outline = as_outline(boundary, f'symmetry = "{self.symmetry}"')
            if not axial:
                return outline
            turned = functools.partial(meridian, outline, twisted=self.twisted)
            return outline.once(("meridian", self.twisted), turned)
        except InputError as error:
            raise InputError(f"{in_body(body.name)}{place}{error}") from None

    @functools.cached_property
    def bodies(self) -> tuple[body_data.Body, ...]:
        """The bodies with their conditions and loads at the end of each step, as functions of the
        place."""
        laws = [
            {s.part: s.law for s in self.interfaces if s.body == b and s.is_condition}
            for b in range(len(self.body))
        ]
        return tuple(posed_body(b, body, laws[b], self.step) for b, body in enumerate(self.body))

    @functools.cached_property
    def obstacles_at(self) -> list[list[Obstacle]]:
        """The obstacles before the first step and at the end of each; a problem without steps has
        one."""
        steps = self.step or (Step(),)
        return list(itertools.accumulate(steps, changed_obstacles, initial=list(self.obstacle)))

    @functools.cached_property
    def interfaces(self) -> tuple[PosedInterface, ...]:
        """Which parts may touch: contact conditions, then contact pairs."""
        interfaces = posed_interfaces(self)
        if not any(side.contact for side in interfaces):
            return interfaces
        return tuple(within_reach(interfaces, self.boundaries))

    @functools.cached_property
    def posed(self) -> Posed:
        """The problem as it is solved: numbers and functions of the place."""
        return Posed(
            self.kind,
            self.symmetry == "axial",
            self.twisted,
            self.bodies,
            self.interfaces,
            tuple(map(tuple, self.obstacles_at)),
            tuple(
                posed.Step(
                    step.name, step.increments, "increments" in step.model_fields_set, step.until
                )
                for step in self.step
            ),
            None if self.cycle is None else self.cycle.posed(cycle_steps(self)),
            self.method,
            self.bem,
            self.petsc,
            self.outline,
        )

    @property
    def boundaries(self) -> list[Boundary]:
        """The outline or surface of each body."""
        return list(map(self.outline, range(len(self.body))))

    @property
    def kind(self) -> Literal["elastic", "bilateral", "contact"]:
        """What a solve looks for, and the only definition of "is it the paper's problem".

        "elastic" problems have no interface. "bilateral" ones are the paper's: one body, loaded
        once, in bilateral contact with fixed ground under a friction bound. All others are
        "contact" problems.
        """
        if not self.interfaces:
            return "elastic"
        held = all(i.holds_normal and i.law.normal != "bonded" for i in self.interfaces)
        return "bilateral" if held and len(self.body) == 1 and not self.step else "contact"

    @property
    def material(self) -> Material:
        """Material of the only body; AttributeError where there are several."""
        return self._one("material").material

    @property
    def geometry(self) -> Geometry:
        """Geometry of the only body; AttributeError where there are several."""
        return self._one("geometry").geometry

    @property
    def mesh(self) -> MeshOptions:
        """Mesh options of the only body; AttributeError where there are several."""
        return self._one("mesh").mesh

    @property
    def boundary(self) -> tuple[Condition, ...]:
        """Conditions of the only body; AttributeError where there are several."""
        return self._one("boundary").boundary

    @property
    def point_force(self) -> tuple[PointForce, ...]:
        """Point forces of the only body; AttributeError where there are several."""
        return self._one("point_force").point_force

    @property
    def loads(self) -> VolumeLoads | None:
        """Loads of the volume of the only body; AttributeError where there are several."""
        return self._one("loads").loads

    def _one(self, key: str) -> Body:
        if len(self.body) > 1:
            names = ", ".join(repr(body.name) for body in self.body)
            raise AttributeError(
                f"{key}: the problem has the bodies {names}; take .body[0].{key} or that of another"
            )
        return self.body[0]

    def model_copy(self, *, update: Mapping[str, object] | None = None, deep: bool = False) -> Self:
        """A copy with other values, which are not checked; keys of a body are those of the one
        body."""
        changes = dict(update or {})
        own = {key: changes.pop(key) for key in OWN if key in changes}
        if own:
            changes["body"] = (self._one(next(iter(own))).model_copy(update=own),)
        copy = super().model_copy(update=changes, deep=deep)
        # they follow from what may have changed
        others = (
            () if changes.keys() <= HOW else ("interfaces", "bodies", "obstacles_at", "twisted")
        )
        for key in ("posed", *others):
            copy.__dict__.pop(key, None)
        return copy

    def ignored(self, *, adaptive: bool = False) -> list[str]:
        """Keys that are given, and that a solve, or an adaptive one, does not read."""
        keys = [f"method.{key}" for key in self.method.ignored]
        for k, body in enumerate(self.body):
            place = "" if self.is_flat else f"body[{k}]."
            if not adaptive or self.outline(k).graded:  # in 3D they make the first mesh
                keys += [f"{place}mesh.{key}" for key in body.mesh.ignored(adaptive=adaptive)]
            if self.outline(k).dim > 2 and "plane" in body.material.model_fields_set:
                keys.append(f"{place}material.plane")
        return keys

    def toml(self) -> str:
        """The whole problem as TOML, defaults filled in; one body called "body" stands at the top
        of the file."""
        data = {
            key: value
            for key, value in self.model_dump(mode="json", exclude_none=True).items()
            if value != []
        }
        bodies = data.pop("body")
        title, units = data.pop("title"), data.pop("units")
        own = {"body": bodies}
        if self.is_flat:
            own = {
                key: value
                for key, value in bodies[0].items()
                if key != "name" and (value != [] or key == "boundary")
            }
        return tomli_w.dumps({"title": title, "units": units, **own, **data})

    def __repr__(self) -> str:
        lines = [f"  {name}: {text}" for name, text in summary(self)]
        return "\n".join([f"<Problem {self.title!r}" if self.title else "<Problem", *lines]) + ">"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """What the problem consists of as an HTML table, for notebooks."""
        return html_table(self.title or "Problem", summary(self))


def _distinct(key: str, names: list[str]) -> None:
    for k, name in enumerate(names):
        if name in names[:k]:
            raise InputError(f"{key}[{k}].name: {name!r} is taken already")


__all__ = [
    "ONE_BODY",
    "OWN",
    "Body",
    "Condition",
    "Contact",
    "Cycle",
    "Displacement",
    "Geometry",
    "Material",
    "Normal",
    "Obstacle",
    "OneBody",
    "Pair",
    "Periodic",
    "PointForce",
    "Problem",
    "Symmetry",
    "Traction",
    "VolumeLoads",
    "changed_condition",
]
