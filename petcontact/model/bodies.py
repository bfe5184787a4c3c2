"""What a problem is made of: bodies with material, shape, mesh and conditions, and the pairs of
parts that may touch."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic

from ..errors import InputError
from ..given.tables.base import (
    Directed,
    Expression,
    Finite,
    Model,
    Name,
    NotNegative,
    Share,
    Vector,
)
from ..given.tables.material import Material
from ..given.tables.points import ExpressionOrPoints
from ..given.tables.solver_options import MeshOptions
from .loads import PointForce, VolumeLoads
from .shapes.files import Gmsh, Superelement
from .shapes.plane import Polygon, Rectangle, SideBySide
from .shapes.solids import Solid


class Displacement(Model):
    """u = value on the part; a component that is "free" carries no traction (a roller), or a given
    one.

    In a config::

        [[boundary]]
        part = "top"
        condition = "displacement"
        value = ["free", -0.1]

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "displacement"
        What is known on the part.
    value : a number, an expression or "free" a component
        Known displacement [length].
    traction : a number or an expression a component, optional
        Known traction of the "free" components; 0 for the others [stress].
    """

    part: str
    condition: Literal["displacement"] = pydantic.Field(default="displacement", kw_only=True)
    value: Annotated[tuple[Expression, ...], Vector]
    traction: Annotated[tuple[Expression, ...], Vector] | None = None

    @pydantic.model_validator(mode="after")
    def _free_where_pulled(self) -> Displacement:
        if self.traction is not None and len(self.traction) != len(self.value):
            raise ValueError(
                f"traction: must have as many components as value, {len(self.value)}, got "
                f"{len(self.traction)}"
            )
        for c, (value, load) in enumerate(zip(self.value, self.traction or (), strict=False)):
            if value != "free" and load != 0.0:
                raise InputError(
                    f'traction[{c}]: must be 0 where value[{c}] is not "free", got {load!r}'
                )
        return self


class Traction(Model):
    """σ(u)n = value on the part, or -pressure·n.

    In a config::

        [[boundary]]
        part = "left"
        condition = "traction"
        pressure = "20*(1 - y/4)"

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "traction"
        What is known on the part.
    value : a number or an expression a component
        Known traction [stress].
    pressure : number or expression
        Instead of value: the traction is -pressure·n [stress].
    """

    part: str
    condition: Literal["traction"] = pydantic.Field(default="traction", kw_only=True)
    value: Annotated[tuple[Expression, ...], Vector] | None = None
    pressure: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> Traction:
        if (self.value is None) == (self.pressure is None):
            given = "neither" if self.value is None else "both"
            raise ValueError(
                f"a traction needs either value = [tx, ty] or pressure = p, got {given}"
            )
        return self


class Symmetry(Model):
    """A plane of symmetry: no normal displacement and no shear on a straight side or a plane face.

    In a config::

        [[boundary]]
        part = "left"
        condition = "symmetry"

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "symmetry"
        What is known on the part.
    """

    part: str
    condition: Literal["symmetry"] = pydantic.Field(default="symmetry", kw_only=True)


class Periodic(Model):
    """Two sides of a plane body of which one is the other moved along: u(partner) = u(part) + jump,
    with opposite tractions.

    In a config::

        [[boundary]]
        part = "left"
        condition = "periodic"
        partner = "right"

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "periodic", in 2D, axial
        What is known on the part.
    partner : str
        Name of the other part, which has no condition of its own.
    jump : vector
        What u grows by from the part to its partner; 0 by default [length].
    """

    part: str
    condition: Literal["periodic"] = pydantic.Field(default="periodic", kw_only=True)
    partner: str
    jump: tuple[Finite, Finite] = (0.0, 0.0)


Normal = Literal["bilateral", "unilateral", "bonded"]


def check_law(law: Contact | Pair) -> None:
    """Refuse friction of parts that are bonded, and wear of parts that have no gap.

    Raises
    ------
    InputError
        One line that names the key.
    """
    coefficient, bonded = law.friction_coefficient, law.normal == "bonded"
    if bonded and not (coefficient is None and law.friction_bound is None):
        raise InputError(
            f"friction_{'bound' if coefficient is None else 'coefficient'}: "
            "bonded parts do not slip; "
            'leave it out, or take normal = "bilateral"'
        )
    if law.wear_coefficient is not None and law.normal != "unilateral":
        raise InputError(
            f"wear_coefficient: wear opens a gap, and {law.normal} parts have none; take normal = "
            f'"unilateral"'
        )


class Contact(Model):
    """Contact with a fixed rigid obstacle; |σ_t| is bounded by Tresca, Coulomb, both (the bound
    caps), or is zero.

    In a config::

        [[boundary]]
        part = "bottom"
        condition = "contact"
        normal = "unilateral"
        friction_coefficient = 0.3

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "contact"
        What is known on the part.
    normal : {"bilateral", "unilateral", "bonded"}
        u_n = gap; pressure p >= 0 where the gap closes, none where it is open; or u = 0 altogether.
        Required beside a gap, an overlap, a preload or a friction coefficient.
    gap : expression or points
        Initial gap along the outward normal [length].
    friction_coefficient : expression, optional
        Coulomb's coefficient µ >= 0: the shear is at most µp, or µ|p| where bilateral contact
        pulls [-].
    friction_bound : expression, optional
        Tresca's bound b >= 0: the shear |σ_t| is at most b [stress]. Without this key and without
        a coefficient the contact is frictionless.
    wear_coefficient : expression, optional
        Archard's coefficient k >= 0 in unilateral contact: the worn depth is k ∫ p |dw|
        [1/stress].
    wear_share : float
        Fraction of the wear on the body, in [0, 1]; the rest wears the obstacle [-].
    interference, clearance : expression, optional
        Overlap that is taken up in the first step, and its opposite; both add to the gap
        [length].
    preload : float, optional
        Force that the overlap of the parts brings about in the first step: of a bonded pair
        tension, else compression [force/length, in 3D force].
    """

    part: str
    condition: Literal["contact"] = pydantic.Field(default="contact", kw_only=True)
    normal: Normal = "bilateral"
    gap: ExpressionOrPoints = 0.0
    friction_coefficient: Expression | None = None
    friction_bound: Expression | None = None
    wear_coefficient: Expression | None = pydantic.Field(default=None, kw_only=True)
    wear_share: Share = pydantic.Field(default=1.0, kw_only=True)
    interference: Expression | None = pydantic.Field(default=None, kw_only=True)
    clearance: Expression | None = pydantic.Field(default=None, kw_only=True)
    preload: NotNegative | None = pydantic.Field(default=None, kw_only=True)

    @pydantic.model_validator(mode="after")
    def _keys_fit_normal(self) -> Contact:
        if "normal" not in self.model_fields_set and not self.plain:
            raise InputError(
                "normal: this key is required beside a gap, an overlap or a friction coefficient; "
                '"unilateral" contact may open, "bilateral" contact stays closed'
            )
        check_law(self)
        return self

    @property
    def plain(self) -> bool:
        """Whether it is the contact of the paper: bilateral without a gap, with a given friction
        bound."""
        others = (self.friction_coefficient, self.interference, self.clearance, self.preload)
        closed = self.normal == "bilateral" and self.gap == 0.0
        return closed and all(value is None for value in others)


Condition = Annotated[
    Displacement | Traction | Symmetry | Periodic | Contact,
    pydantic.Field(discriminator="condition"),
]
Geometry = Annotated[
    Rectangle | Polygon | SideBySide | Solid | Gmsh | Superelement,
    pydantic.Field(discriminator="shape"),
]


class Body(Model):
    """One elastic body; parts without a condition or a contact are free of traction.

    In a config::

        [[body]]
        name = "upper"
        material = { young_modulus = 210_000.0, poisson_ratio = 0.3 }
        geometry = { shape = "rectangle", lower_left = [0, 0], upper_right = [8, 4] }
        boundary = [{ part = "top", condition = "displacement", value = [0, -0.01] }]

    Attributes
    ----------
    name : str
        Name of the body.
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
    loads : VolumeLoads
        Weight, rotation, temperature and other loads of the volume.
    """

    name: Name
    material: Material
    geometry: Geometry
    mesh: MeshOptions = MeshOptions.model_construct()
    boundary: tuple[Condition, ...] = ()
    point_force: tuple[PointForce, ...] = ()
    loads: VolumeLoads | None = None

    def condition(self, part: str) -> Condition | None:
        """The condition of a part."""
        return next((c for c in self.boundary if c.part == part), None)


def _name_or_names(value: object) -> object:
    """One check instead of a union, whose report would name every branch."""
    if isinstance(value, (list, tuple)) and value and all(isinstance(one, str) for one in value):
        return tuple(value)
    if not isinstance(value, str):
        raise InputError("must be a name or a list of names")
    return value


NameOrNames = Annotated[str | tuple[str, ...], pydantic.BeforeValidator(_name_or_names)]


def names_of(names: str | tuple[str, ...]) -> tuple[str, ...]:
    """The names in one key, which may be one or several."""
    return (names,) if isinstance(names, str) else names


def part_name(contact: str, secondary: str, primary: str) -> str:
    """What one secondary with one primary of a contact of several parts is called in results."""
    return f"{contact}: {primary} on {secondary}"


class Pair(Model):
    """Two parts that may touch, or several, of which each node takes the one that it meets first.

    In a config::

        [[contact]]
        name = "interface"
        secondary = "upper.bottom"
        primary = "lower.top"
        friction_coefficient = 0.3

    Attributes
    ----------
    name : str
        Name of the pair.
    secondary : str or list of str
        "body.part": the side whose nodes are collocated; pressure and shear live there.
    primary : str or list of str
        "body.part", or the name of an obstacle. Of several each node takes the one that it meets
        first, the nearest along the direction; results tell each part's share of the force.
    normal : {"unilateral", "bilateral", "bonded"}
        Unilateral contact may open, bilateral contact stays closed and may slip, bonded contact
        does neither.
    gap : "geometry", expression or points
        Initial gap [length]. "geometry" is the distance along the direction; it is 0 against an
        obstacle without a shape, and where the contact is bilateral or bonded. An expression is in
        the secondary's x, y, nx, ny, s, in 3D x, y, z, nx, ny, nz.
    direction : vector, optional
        Direction of the gap, from the secondary to the primary; the secondary's outward normal by
        default [-].
    friction_coefficient : expression, optional
        Coulomb's coefficient µ >= 0: the shear is at most µp, or µ|p| where bilateral contact
        pulls [-].
    friction_bound : expression, optional
        Tresca's bound b >= 0: the shear |σ_t| is at most b, also where Coulomb's law would allow
        more [stress]. Without this key and without a coefficient the contact is frictionless.
    wear_coefficient : expression, optional
        Archard's coefficient k >= 0 in unilateral contact: the worn depth of both sides together
        is k ∫ p |dw| [1/stress].
    wear_share : float
        Fraction of the wear on the secondary side, in [0, 1]; the rest wears the primary [-].
    interference, clearance : expression, optional
        Overlap that is taken up in the first step, and its opposite; both add to the gap
        [length].
    preload : float, optional
        Force that the overlap of the parts brings about in the first step: of a bonded pair
        tension, else compression [force/length, in 3D force].
    """

    name: Name
    secondary: NameOrNames
    primary: NameOrNames
    normal: Normal = "unilateral"
    gap: ExpressionOrPoints = "geometry"
    direction: Annotated[tuple[Finite, ...], Vector, Directed] | None = None
    friction_coefficient: Expression | None = None
    friction_bound: Expression | None = None
    wear_coefficient: Expression | None = None
    wear_share: Share = 0.5
    interference: Expression | None = pydantic.Field(default=None, kw_only=True)
    clearance: Expression | None = pydantic.Field(default=None, kw_only=True)
    preload: NotNegative | None = pydantic.Field(default=None, kw_only=True)

    @pydantic.model_validator(mode="after")
    def _keys_fit_normal(self) -> Pair:
        check_law(self)
        for key in ("secondary", "primary"):
            names = names_of(getattr(self, key))
            for name in names:
                if names.count(name) > 1:
                    raise InputError(f"{key}: {name!r} is named twice; name each part once")
        if self.has_several and self.preload is not None:
            raise InputError(
                "preload: is of one secondary and one primary; give each pair that has one a "
                "[[contact]] of its own"
            )
        return self

    @property
    def has_several(self) -> bool:
        """Whether one of its sides has several parts."""
        return len(names_of(self.secondary)) * len(names_of(self.primary)) > 1
