"""The material of a body."""

from __future__ import annotations

from typing import Literal

import pydantic

from .base import Finite, Model, NotNegative, Positive


class Material(Model):
    """Isotropic linear elasticity; `plane` says nothing in 3D.

    In a config::

        [material]
        young_modulus = 210_000.0
        poisson_ratio = 0.3
        density = 7.85e-9

    Attributes
    ----------
    young_modulus : float
        E > 0 [stress].
    poisson_ratio : float
        ν in (-1, 1/2); up to 1/2 itself in plane stress [-].
    plane : {"strain", "stress"}, in 2D
        "strain" for a long body, "stress" for a thin plate.
    density : float, optional
        Mass density, for accelerations and rotations [mass/volume].
    thermal_expansion : float, optional
        α, for temperatures [1/temperature].
    thickness : float, optional, in 2D
        Of the body, across the plane [length]. Forces, moments and areas are then those of the
        whole thickness; without it they are per length. All bodies have one, or none.
    """

    young_modulus: Positive
    poisson_ratio: Finite
    plane: Literal["strain", "stress"] = "strain"
    density: NotNegative | None = pydantic.Field(default=None, kw_only=True)
    thermal_expansion: Finite | None = pydantic.Field(default=None, kw_only=True)
    thickness: Positive | None = pydantic.Field(default=None, kw_only=True)

    @pydantic.model_validator(mode="after")
    def _admissible(self) -> Material:
        upper = self.poisson_ratio < 0.5 or (self.plane == "stress" and self.poisson_ratio == 0.5)
        if not (self.poisson_ratio > -1.0 and upper):
            bounds = "(-1, 1/2)" if self.plane == "strain" else "(-1, 1/2] in plane stress"
            rubber = "; rubber has 0.499" if self.poisson_ratio == 0.5 else ""
            raise ValueError(
                f"poisson_ratio must lie in {bounds}, got {self.poisson_ratio:g}{rubber}"
            )
        return self

    @property
    def shear_modulus(self) -> float:
        """µ = E / 2(1+ν) [stress]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def thermal_stress(self) -> float:
        """β = Eα/(1-2ν), in plane stress Eα/(1-ν): without strain a rise of temperature T makes the
        stress -βT I [stress/temperature]."""
        shape = 1.0 - self.poisson_ratio * (1.0 if self.plane == "stress" else 2.0)
        return self.young_modulus * (self.thermal_expansion or 0.0) / shape

    @property
    def plane_strain_ratio(self) -> float:
        """The ν with which the plane-strain kernels describe this material: ν/(1+ν) for plane
        stress."""
        return (
            self.poisson_ratio / (1.0 + self.poisson_ratio)
            if self.plane == "stress"
            else self.poisson_ratio
        )
