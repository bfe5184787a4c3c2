"""What is reported of a solve: its accuracy, where it came from, and what checks found."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import TypeVar

from ..record import field, fields, record

T = TypeVar("T")


@record
class Accuracy:
    """The error of a solution in L2 of the contact, relative to it, and how it is known.

    The error is that of u_t of the paper's problem, of p and q in other contact, and of u without
    contact.

    Attributes
    ----------
    wanted : float, optional
        What an adaptive solve was asked for; None on meshes that the user fixed [-].
    error : float
        Estimate; infinite where too few meshes were solved on, nan where it is not known [-].
    unknown : str
        Why it is not known.
    resultants : float
        Estimated error of forces, nan where it is not known [-].
    pairs : dict of pairs of float
        By interface, its own `error` and `resultants`, where they are known for each [-].
    shared : float
        Error of forces that all meshes have in common, of given loads and of bending [-].
    with_ends : float
        The error with the ends of parts, which `error` leaves out, nan where it is not known [-].
    tractions : float
        In the plane that of p and q where `error` is that of u_t, which is much smaller: p wiggles
        where stick changes to slip. nan where it is not known [-].
    singular : dict of lists of float
        By interface, arc lengths where tractions grow from mesh to mesh [length].
    differences, estimates : lists of float
        Between neighbouring meshes of an adaptive solve, and on each of its meshes [-].
    elements : list of int
        Of all bodies, on each mesh.
    meshes_differ : str
        Where the last two meshes differ most.
    edges : dict of lists of float
        By interface, arc lengths of the edges of contact and of stick [length].
    zones : list of tuples, optional
        Fields of `Zone`, with ends as an adaptive solve places them.
    zone_errors : list of pairs of float
        How far the ends of zones moved from mesh to mesh [length].
    path : float
        Error that the increments leave in p and q, over p in L2: 0 where the path does not matter,
        nan where it is not known [-].
    unseen : dict of lists of float
        By body, the largest given traction of each part that the functions of a given mesh do not
        have, where there is one [stress].
    """

    wanted: float | None = None
    error: float = math.nan
    unknown: str = ""
    resultants: float = math.nan
    pairs: dict[str, tuple[float, float]] = field(default_factory=dict)
    shared: float = 0.0
    with_ends: float = math.nan
    tractions: float = math.nan
    singular: dict[str, list[float]] = field(default_factory=dict)
    differences: list[float] = field(default_factory=list)
    estimates: list[float] = field(default_factory=list)
    elements: list[int] = field(default_factory=list)
    meshes_differ: str = ""
    edges: dict[str, list[float]] = field(default_factory=dict)
    zones: list[tuple[str, float, float, int]] | None = None
    zone_errors: list[tuple[float, float]] = field(default_factory=list)
    path: float = 0.0
    unseen: dict[str, list[float]] = field(default_factory=dict)

    @property
    def is_known(self) -> bool:
        """Whether there is an estimate."""
        return not math.isnan(self.error)


@record
class Provenance:
    """How a solution was made.

    Attributes
    ----------
    solver, ksp_reason : str
        Storage of the bodies and factorisation, and why the Krylov solver ended.
    method, rule : str
        Names, also of those that are the user's own.
    argv, petsc_options, versions : str
        The command, all PETSc options in force, and versions of what the digits depend on.
    ranks : int
        Number of MPI ranks.
    peak_memory : float
        Of all ranks; 0 where it is not known [bytes].
    distance : dict of float by interface
        The smallest gap before any load, an overlap being negative; infinite where nothing is faced
        [length].
    motions : dict of int by body
        Number of rigid motions that only contact holds.
    """

    solver: str = ""
    ksp_reason: str = ""
    method: str = ""
    rule: str = ""
    argv: str = ""
    petsc_options: str = ""
    versions: str = ""
    ranks: int = 1
    peak_memory: float = 0.0
    distance: dict[str, float] = field(default_factory=dict)
    motions: dict[str, int] = field(default_factory=dict)


@record
class Finding:
    """One thing that a check found.

    Attributes
    ----------
    kind : str
        What was looked at; `KINDS` of `pipeline/judge/findings.py` lists all kinds.
    severity : {"failed", "not converged", "warning", "note"}
        What the judge makes of it: it ends the solve, is shown as a warning, or is told beside the
        reason.
    text : str
        What was found, a clause.
    where : str
        The interface, body or step, in words.
    advice : str
        What to change.
    measured, limit : float
        The number that was looked at and its bound, nan where there is none.
    """

    kind: str
    severity: str
    text: str
    where: str = ""
    advice: str = ""
    measured: float = math.nan
    limit: float = math.nan

    def __str__(self) -> str:
        place, advice = f"{self.where}: " if self.where else "", f"; {self.advice}"
        return f"{place}{self.text}{advice if self.advice else ''}"


def as_json(record: Accuracy | Provenance) -> str:
    """A record as a table of its fields."""
    return json.dumps({each.name: getattr(record, each.name) for each in fields(record)})


def from_table(kind: type[T], table: Mapping[str, object]) -> T:
    """A record from a table, which may hold other entries."""
    names = [each.name for each in fields(kind)]  # type: ignore[arg-type]
    return kind(**{name: table[name] for name in names if name in table})
