"""Names of units, for figures and files."""

from __future__ import annotations

from typing import Annotated

import pydantic

from .base import Model

FORCES = {
    ("Pa", "m"): "N",
    ("kPa", "m"): "kN",
    ("MPa", "m"): "MN",
    ("MPa", "mm"): "N",
    ("GPa", "mm"): "kN",
}
"""The unit of force by those of stress and length."""
UnitName = Annotated[str, pydantic.Field(min_length=1, max_length=20)]


class Units(Model):
    """The `[units]` table: names that figures and files write; nothing is converted, any consistent
    units will do.

    In a config::

        units = { length = "mm", stress = "MPa" }

    Attributes
    ----------
    length : str, optional
        Unit of length, for example "mm".
    stress : str, optional
        Unit of stress, for example "MPa".
    """

    length: UnitName | None = None
    stress: UnitName | None = None

    @pydantic.model_validator(mode="after")
    def _not_the_other(self) -> Units:
        stresses, lengths = map(set, zip(*FORCES, strict=True))
        if self.length in stresses or self.stress in lengths:
            raise ValueError("length and stress are exchanged, or one of them is no such unit")
        return self

    @property
    def stiffness(self) -> str | None:
        """Name of the unit of ρ, stress over length; None without names."""
        return f"{self.stress}/{self.length}" if self.stress and self.length else None

    def stress_times(self, power: int) -> str | None:
        """Stress times a power of length, 1 to 3: a force (per thickness) has power dim - 1, an
        energy dim. Named by the force where the names tell it.

        >>> Units(length="mm", stress="MPa").stress_times(1)
        'N/mm'
        >>> Units(length="mm", stress="daN/mm²").stress_times(3)
        'daN·mm'
        >>> Units(length="inch", stress="psi").stress_times(2)
        'psi·inch²'
        """
        if not (self.stress and self.length):
            return None
        force = FORCES.get((self.stress, self.length))
        if self.stress.endswith(area := f"/{self.length}²"):
            force = self.stress.removesuffix(area)
        if force is None:
            return f"{self.stress}·{self.length}{' ²³'[power - 1].strip()}"
        return (f"{force}/{self.length}", force, f"{force}·{self.length}")[power - 1]
