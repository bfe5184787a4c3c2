"""Names of the units that a problem is given in."""

from __future__ import annotations

from typing import Annotated

import pydantic

from .base import Model

Name = Annotated[str, pydantic.Field(min_length=1, max_length=20)]


class Units(Model):
    """The `[units]` table: names that figures and files write; nothing is converted, any consistent units will do.

    Attributes
    ----------
    length : str, optional
        For example "mm".
    stress : str, optional
        For example "MPa".
    """

    length: Name | None = None
    stress: Name | None = None

    @property
    def stiffness(self) -> str | None:
        """Stress over length."""
        return f"{self.stress}/{self.length}" if self.stress and self.length else None

    @property
    def force(self) -> str | None:
        """Stress times length: a force per thickness of a plane body."""
        return f"{self.stress}·{self.length}" if self.stress and self.length else None
