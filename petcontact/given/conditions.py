"""Conditions of the parts of a body, whose data are functions of the place."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..record import record
from .interface_data import Law
from .sites import Sites
from .values import Given


@record
class Term:
    """Vectors of one kind that are given on a part.

    Attributes
    ----------
    kind : {"displacement", "traction"}
    data : tuple of Given
        A datum a component, None where the component is free; or one pressure.
    is_pressure : bool
        Whether the datum acts against the outward normal.
    """

    kind: str
    data: tuple[Given | None, ...]
    is_pressure: bool = False

    @property
    def given(self) -> list[Given]:
        """The data of the components that are not free."""
        return [datum for datum in self.data if datum is not None]

    @property
    def varies(self) -> bool:
        """Whether some datum varies, and all are known everywhere."""
        return any(datum.varies for datum in self.given) and self.everywhere

    @property
    def everywhere(self) -> bool:
        """Whether all data are known at all places."""
        return all(datum.everywhere for datum in self.given)

    def at(self, sites: Sites, normal: Array) -> Array:
        """Return the vectors (n, d) at sites, with normals (n, d) of as many components.

        Raises
        ------
        InputError
            As `Given.at`.
        """
        return self._vectors(
            [None if datum is None else datum.at(sites) for datum in self.data], normal
        )

    def near(self, sites: Sites, normal: Array) -> Array:
        """Return the vectors (n, d) at sites, 0 where they are not finite."""
        return self._vectors(
            [None if datum is None else datum.near(sites) for datum in self.data], normal
        )

    def _vectors(self, columns: list[Array | None], normal: Array) -> Array:
        zeros = np.zeros(len(normal))
        known = np.column_stack([zeros if column is None else column for column in columns])
        return -known * normal if self.is_pressure else known


@record
class Displacement:
    """A part with given displacements.

    Attributes
    ----------
    part : str
    value : tuple of Given
        Displacement by component [length]; None where it is free.
    traction : tuple of Given, optional
        Traction of the free components [stress].
    onward : tuple of bool, or False
        Which components are added to what the step before has left.
    """

    part: str
    value: tuple[Given | None, ...]
    traction: tuple[Given, ...] | None = None
    onward: tuple[bool, ...] | bool = False

    @property
    def free(self) -> list[bool]:
        """Which components are free."""
        return [datum is None for datum in self.value]

    @property
    def terms(self) -> tuple[Term, ...]:
        """The displacement, and the traction of its free components."""
        loads = () if self.traction is None else (Term("traction", self.traction),)
        return (Term("displacement", self.value), *loads)


@record
class Traction:
    """A part with given tractions, by component or as a pressure [stress]."""

    part: str
    value: tuple[Given, ...] | None = None
    pressure: Given | None = None

    @property
    def terms(self) -> tuple[Term, ...]:
        """The traction."""
        if self.pressure is not None:
            return (Term("traction", (self.pressure,), is_pressure=True),)
        return (Term("traction", self.value or ()),)


@record
class Symmetry:
    """A part in a plane of symmetry."""

    part: str
    terms: tuple[Term, ...] = ()


@record
class Periodic:
    """A part of which the partner is the same one moved along; u grows by the jump [length]."""

    part: str
    partner: str
    jump: tuple[float, ...]
    terms: tuple[Term, ...] = ()


@record
class Contact:
    """A part that touches another one, or the ground, under a law."""

    part: str
    law: Law
    terms: tuple[Term, ...] = ()


Condition = Displacement | Traction | Symmetry | Periodic | Contact
