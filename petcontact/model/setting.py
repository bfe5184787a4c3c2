"""What a problem says besides its bodies, and the bodies by name and number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import pydantic

from ..errors import ONE_BODY
from ..given.tables.base import Finite, Model
from ..given.tables.solver_options import Bem, Method, Options
from ..given.tables.units import Units
from ..runtime.hints import nearest
from .bodies import Body, Pair
from .cycle import Cycle
from .load_steps import Step
from .obstacles import Obstacle


class Setting(Model):
    """What a problem says besides its bodies.

    Attributes
    ----------
    title : str
        Title of the problem, for verdict and figures.
    symmetry : {"plane", "axial"}, optional
        "axial": bodies of revolution, whose half sections are given by x, the distance r >= 0 from
        the axis, and y, the height z along it. Forces are those on whole rings. Vectors may have a
        third component, round the axis by the right-hand rule about +z.
    units : Units
        Names of the units, for figures and files.
    variables : dict of name to float
        Lengths, moduli, angles by name. In a file any number may be an expression of them, as
        "2*t + 1", and sweeps vary "variables.t".
    obstacle : list of Obstacle
        Rigid bodies.
    contact : list of Pair
        Which parts may touch.
    step : list of Step
        Load steps, in order; without them the loads are applied in one.
    cycle : Cycle, optional
        Steps that are done again and again.
    method : Method
        How the contact problem is solved.
    bem : Bem
        How the boundary operators are stored.
    petsc : dict
        PETSc options without the leading dash; `-options_file` and the command line have
        precedence.
    """

    title: str = ""
    symmetry: Literal["plane", "axial"] | None = pydantic.Field(default=None, kw_only=True)
    units: Units = Units.model_construct()
    variables: dict[str, Finite] = {}  # noqa: RUF012 (pydantic copies it)
    obstacle: tuple[Obstacle, ...] = ()
    contact: tuple[Pair, ...] = ()
    step: tuple[Step, ...] = ()
    cycle: Cycle | None = None
    method: Method = Method.model_construct()
    bem: Bem = Bem.model_construct()
    petsc: Options = {}  # noqa: RUF012 (pydantic copies it)


class Bodies(Setting):
    """Bodies, and what a problem says besides them.

    Attributes
    ----------
    body : list of Body
        The elastic bodies.
    """

    body: tuple[Body, ...] = pydantic.Field(min_length=1, kw_only=True)

    @property
    def is_flat(self) -> bool:
        """Whether it is one body of a file without [[body]]."""
        return len(self.body) == 1 and self.body[0].name == ONE_BODY

    def side(self, key: str, text: str, obstacles: Sequence[str] = ()) -> tuple[int, str]:
        """Number of the body and name of the part that "body.part" means; of a single body "part"
        will do."""
        bodies = [body.name for body in self.body]
        name, dot, part = text.partition(".")
        if not dot and len(bodies) == 1 and text not in bodies:
            name, dot, part = bodies[0], ".", text
        if name not in bodies or not part:
            rule = 'must be "body.part"' + (" or the name of an obstacle" if obstacles else "")
            names = [*(f"{body}.…" for body in bodies), *obstacles]
            near = "" if name in bodies else nearest(name, [*bodies, *obstacles])
            hint = near or f"; there are {', '.join(names)}"
            raise ValueError(f"{key}: {rule}, got {text!r}{hint}")
        return bodies.index(name), part
