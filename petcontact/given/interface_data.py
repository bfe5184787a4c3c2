"""The interfaces of a problem: which parts may touch, and under which law."""

from __future__ import annotations

from ..arrays import Array
from ..record import record
from .values import Given

FRICTION = ("friction_coefficient", "friction_bound")
PLACED = (*FRICTION, "interference", "clearance")
"""Keys of a contact that steps change, and that may vary with the place."""


@record
class Law:
    """What holds where two parts meet.

    Attributes
    ----------
    normal : {"bilateral", "unilateral", "bonded"}
        Whether the parts stay closed and may slip, may open, or do neither.
    gap : Given, optional
        Initial gap [length]; None for the distance of the parts as they lie.
    friction_coefficient : Given, optional
        Coulomb's coefficient [-].
    friction_bound : Given, optional
        Largest shear [stress].
    wear_coefficient : Given, optional
        Archard's coefficient [1/stress].
    wear_share : float
        Share of the wear on the secondary [-].
    interference, clearance : Given, optional
        Overlap that is taken up, and its opposite [length].
    preload : float or "locked", optional
        Force that the overlap of the parts brings about, or "locked": the overlap stays.
    """

    normal: str
    gap: Given | None
    friction_coefficient: Given | None
    friction_bound: Given | None
    wear_coefficient: Given | None
    wear_share: float
    interference: Given | None = None
    clearance: Given | None = None
    preload: float | str | None = None

    @property
    def is_paper(self) -> bool:
        """Whether it is the contact of the paper: bilateral without a gap, with a given friction
        bound."""
        closed = self.gap is not None and self.gap.source == 0.0
        return self.normal == "bilateral" and closed and self.friction_coefficient is None

    @property
    def has_friction(self) -> bool:
        """Whether a coefficient or a bound is given."""
        return self.friction_coefficient is not None or self.friction_bound is not None


@record
class PosedInterface:
    """One interface of a problem.

    Attributes
    ----------
    name, key : str
        Name, and the place in the config for errors.
    body : int
        Number of the body of the secondary.
    part : str
        Part of the secondary.
    primary : (int, str), optional
        Body and part of the primary.
    obstacle : int, optional
        Number of the obstacle; with neither a body nor an obstacle the primary is fixed ground.
    law : Law
        The normal condition, the gap, friction and wear; where steps change it, the friction that
        it has in any of them.
    laws : tuple of Law
        The law in each load state: without load, and at the end of each step.
    direction : (d,) array, optional
        Unit vector from the secondary to the primary.
    periodic : bool
        Whether the primary is the secondary moved along.
    is_condition : bool
        Whether it is the boundary condition of its part, and not a pair.
    contact : str, optional
        Name of the contact of several parts to which it belongs.
    choice : int
        Number of its primary among those of that contact.
    """

    name: str
    key: str
    body: int
    part: str
    primary: tuple[int, str] | None
    obstacle: int | None
    law: Law
    direction: Array | None
    laws: tuple[Law, ...]
    periodic: bool = False
    is_condition: bool = False
    contact: str | None = None
    choice: int = 0

    @property
    def group(self) -> str:
        """Name of the contact to which it belongs, its own where it is one by itself."""
        return self.contact or self.name

    @property
    def rubs(self) -> bool:
        """Whether there is friction in any step; a coefficient or a bound of 0 is none."""
        laws = self.law, *self.laws
        given = [each for law in laws for each in (law.friction_coefficient, law.friction_bound)]
        return any(each is not None and each.source != 0.0 for each in given)

    @property
    def preloaded(self) -> bool:
        """Whether a force says which overlap its parts have, in some step."""
        return any(law.preload is not None for law in self.laws)

    @property
    def pressed(self) -> bool:
        """Whether its parts overlap by more than they lie, in some step."""
        return self.preloaded or any(law.interference is not None for law in self.laws)

    @property
    def ends(self) -> list[tuple[int, str]]:
        """Body and part of the secondary, and of the primary where that is a body."""
        return [end for end in ((self.body, self.part), self.primary) if end is not None]

    @property
    def bodies(self) -> list[int]:
        """Numbers of the bodies that meet."""
        return [number for number, _ in self.ends]

    @property
    def holds_normal(self) -> bool:
        """Whether u_n = gap is known data of the body, as in the paper.

        This is so in contact with fixed ground that the body cannot leave, under friction that
        does not depend on pressure. A method looks for tangential tractions only then.
        """
        return (
            self.primary is None
            and self.obstacle is None
            and self.direction is None
            and self.law.normal != "unilateral"
            and self.law.friction_coefficient is None
            and not self.preloaded
        )
