"""The problem: material, boundary conditions, and what belongs together to pose one."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic

from .base import Expression, Finite, Model, Positive
from .load_steps import Step
from .mesh_options import MeshOptions
from .shapes import Box, Gmsh, Polygon, Rectangle, SideBySide
from .units import Units


class Material(Model):
    """Isotropic linear elasticity; `plane` says nothing in space.

    Attributes
    ----------
    young_modulus : float
        E > 0 [stress].
    poisson_ratio : float
        ν in (-1, 1/2); up to 1/2 itself in plane stress [-].
    plane : {"strain", "stress"}
        A long body, or a thin plate.
    """

    young_modulus: Positive
    poisson_ratio: Finite
    plane: Literal["strain", "stress"] = "strain"

    @pydantic.model_validator(mode="after")
    def _admissible(self) -> Material:
        upper = self.poisson_ratio < 0.5 or (self.plane == "stress" and self.poisson_ratio == 0.5)
        if not (self.poisson_ratio > -1.0 and upper):
            bounds = "(-1, 1/2)" if self.plane == "strain" else "(-1, 1/2]"
            raise ValueError(f"poisson_ratio must lie in {bounds} in plane {self.plane}, got {self.poisson_ratio:g}")
        return self

    @property
    def shear_modulus(self) -> float:
        """µ = E / 2(1+ν) [stress]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def plane_strain_ratio(self) -> float:
        """The ν with which the plane-strain kernels describe this material: ν/(1+ν) for plane stress."""
        return self.poisson_ratio / (1.0 + self.poisson_ratio) if self.plane == "stress" else self.poisson_ratio


Component = Expression
"""Or "free"."""
Vector = pydantic.Field(min_length=2, max_length=3)
"""As many components as the body has dimensions."""


class Displacement(Model):
    """u = value on the part; a component that is "free" carries no traction (a roller).

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "displacement"
        What is known on the part.
    value : a number, an expression or "free" a component
        Known displacement [length].
    """

    part: str
    condition: Literal["displacement"] = "displacement"
    value: Annotated[tuple[Component, ...], Vector]


class Traction(Model):
    """σ(u)n = value on the part, or -pressure·n.

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
    condition: Literal["traction"] = "traction"
    value: Annotated[tuple[Expression, ...], Vector] | None = None
    pressure: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> Traction:
        if (self.value is None) == (self.pressure is None):
            raise ValueError("a traction needs either value = [tx, ty] or pressure = p")
        return self


Normal = Literal["bilateral", "unilateral", "bonded"]


def no_friction_if_bonded(normal: Normal, coefficient: object, bound: object) -> None:
    """Refuse friction of parts that are bonded."""
    if normal == "bonded" and not (coefficient is None and bound is None):
        key = "friction_bound" if coefficient is None else "friction_coefficient"
        raise ValueError(f'{key}: bonded parts do not slip; leave it out, or take normal = "bilateral"')


class Contact(Model):
    """Contact with a fixed rigid obstacle; |σ_t| is bounded by Tresca, Coulomb, both (the bound caps), or is zero.

    Attributes
    ----------
    part : str
        Name of the part.
    condition : "contact"
        What is known on the part.
    normal : {"bilateral", "unilateral", "bonded"}
        u_n = gap; pressure p >= 0 where the gap closes, none where it is open; or u = 0 altogether.
    gap : expression
        Initial gap along the outward normal [length].
    friction_coefficient : expression, optional
        µ >= 0 of Coulomb's law |σ_t| <= µp [-].
    friction_bound : expression, optional
        g >= 0 of Tresca's law |σ_t| <= g [stress]; with neither the contact is frictionless.
    """

    part: str
    condition: Literal["contact"] = "contact"
    normal: Normal = "bilateral"
    gap: Expression = 0.0
    friction_coefficient: Expression | None = None
    friction_bound: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _bonded_does_not_slip(self) -> Contact:
        no_friction_if_bonded(self.normal, self.friction_coefficient, self.friction_bound)
        return self

    @property
    def plain(self) -> bool:
        """Whether it is the contact of the paper: bilateral without a gap, with a given friction bound."""
        return self.normal == "bilateral" and self.gap == 0.0 and self.friction_coefficient is None


Condition = Annotated[Displacement | Traction | Contact, pydantic.Field(discriminator="condition")]
Geometry = Annotated[Rectangle | Polygon | SideBySide | Box | Gmsh, pydantic.Field(discriminator="shape")]


class Problem(Model):
    """A contact problem of one body: what TOML says above `[method]`, and what Python builds with keyword arguments.

    Attributes
    ----------
    title : str
        Of the problem, for verdict and figures.
    units : Units
        Names of the units, for figures and files.
    material : Material
        What the body is made of.
    geometry : Rectangle, Polygon, ...
        Its shape.
    mesh : MeshOptions
        Sizes, order and grading of the elements.
    boundary : list
        One condition for every part.
    step : list of Step
        Load steps, in order; without them the loads are applied in one.
    """

    title: str = ""
    units: Units = Units()
    material: Material
    geometry: Geometry
    mesh: MeshOptions = MeshOptions()
    boundary: tuple[Condition, ...]
    step: tuple[Step, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether one solve with the methods of the paper answers it: bilateral Tresca contact, no load steps."""
        return not self.step and all(c.plain for c in self.boundary if isinstance(c, Contact))
