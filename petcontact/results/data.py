"""What a solve found: every increment, and views of the last one."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Self

import numpy as np

from ..arrays import Array
from ..contact.friction_law import main_direction, signed
from ..contact.law_protocol import OPEN, SLIP
from ..errors import InputError, MissingPackage
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import field, record, replace
from ..refinement.zones import Zone, zones_of
from ..runtime.hints import Listed
from ..untyped import DataFrame, Keyed
from .evaluated import Evaluated
from .numbers.errors import with_errors
from .numbers.number import Number
from .records import BodyResult, ContactFields, PairResult, StepResult, along_tangents, below
from .report import Finding


@record
class SolutionData(Evaluated):
    """What a solve found and a result file holds; `Solution` adds what can be done with it."""

    written: tuple[Number, ...] | None = field(default=None, repr=False, compare=False)

    @functools.cached_property
    def numbers(self) -> Listed[Number]:
        """The numbers that the verdict prints, with their errors; those of a name are
        numbers["largest p"]."""
        if self.written is not None:
            return Listed(self.written)
        # numbers of an altered file, or of a solve that failed, may overflow
        with np.errstate(all="ignore"):
            return Listed(with_errors(self))

    @property
    def converged(self) -> bool:
        """Whether every step was reached with all residuals small."""
        return self.status == "converged"

    @property
    def warnings(self) -> list[str]:
        """What a user should know of a solution that is accepted: findings in words."""
        return [str(each) for each in self.findings if each.severity == "warning"]

    def with_findings(self, findings: Iterable[Finding]) -> Self:
        """A copy with more findings of the judge."""
        return replace(self, findings=(*self.findings, *findings))

    @property
    def iterations(self) -> int:
        """Iterations of all increments, the failed one too."""
        return sum(step.iterations for step in self.tried)

    @property
    def pairs(self) -> dict[str, PairResult]:
        """Interfaces after the last increment; against fixed ground by the name of the part."""
        return self.last.pairs

    @property
    def bodies(self) -> dict[str, BodyResult]:
        """Bodies after the last increment."""
        return self.last.bodies

    @property
    def kind(self) -> str:
        """What the solve looked for: "elastic", "bilateral" (the paper's problem) or "contact".

        It is `problem.kind`, but "contact" where friction alone holds the body: its equilibrium
        needs tractions in all directions.
        """
        held_by_friction = self.problem.kind == "bilateral" and self.last.alpha.size > 0
        return "contact" if held_by_friction else self.problem.kind

    def only_body(self, what: str) -> str:
        """The name of the only body.

        Raises
        ------
        InputError
            If there are several, naming `what` was asked of them.
        """
        if len(self.meshes) > 1:
            raise InputError(
                f"{what}: of one body only; this solution has {', '.join(self.meshes)}: see "
                ".meshes, .bodies and .pairs"
            )
        return next(iter(self.meshes))

    @property
    def mesh(self) -> BoundaryMesh:
        """Mesh of the only body."""
        return self.meshes[self.only_body("mesh")]

    @property
    def u(self) -> Array:
        """Displacement (n, d) on the boundary of the only body [length]."""
        return self.bodies[self.only_body("u")].u

    @property
    def traction(self) -> Array:
        """Traction (n, d) on the boundary of the only body [stress]."""
        return self.bodies[self.only_body("traction")].traction

    def time(self, step: StepResult) -> float:
        """An increment's place in the order of things: each step takes 1, the first time and in
        every later cycle."""
        cycle, steps = self.posed.cycle, self.posed.cycle_steps
        before = (
            0
            if cycle is None
            else cycle.count - 1
            if step.step > steps[-1]
            else max(step.cycle, 1) - 1
        )
        return before * len(steps) + step.step - 1 + step.load_factor

    def columns(self, step: StepResult | None = None) -> Keyed:
        """Nodal fields of all interfaces after an increment, the last one by default, below one
        another.

        Where a contact has several primaries, a node stands in the row of the one that it meets.

        Returns
        -------
        dict of str to (m, ...) array
            Those of `ContactFields` and `PairResult`, and the names of pair, body and part of every
            node.
        """
        step = step or self.last
        columns = list[Keyed]()
        for name, pair in step.pairs.items():
            body, part = self.sides[name]
            nodes, names = self.nodes[name], {"part": part, "body": body, "pair": name}
            columns.append(
                {
                    "nodes": nodes,
                    "x": pair.x,
                    "normal": pair.normal,
                    "tangent": pair.tangent,
                    "weight": pair.weight,
                    "arc_length": pair.arc_length,
                    "u_t": np.einsum("mc,mtc->mt", step.bodies[body].u[nodes], pair.tangent),
                    "sigma_t": pair.sigma_t,
                    "sigma_n": 0.0 - pair.pressure,
                    "friction_bound": pair.bound,
                    "state": pair.state,
                    "gap": pair.gap,
                    "slip": pair.slip,
                    "slip_increment": pair.slip_increment,
                    "pressure": pair.pressure,
                    "worn_depth": np.zeros(len(nodes))
                    if pair.wear is None
                    else pair.wear.sum(axis=1),
                    **{key: np.full(len(nodes), text) for key, text in names.items()},
                }
            )
        return _once(below(columns)) or _no_rows(next(iter(self.meshes.values())).dim)

    @functools.cached_property
    def contact(self) -> ContactFields:
        """Nodal fields on the contact parts of the only body after the last increment."""
        self.only_body("contact")
        columns = self.columns()
        order = np.argsort(columns["nodes"], kind="stable")
        return ContactFields(
            **{name: columns[name][order] for name in ContactFields.__dataclass_fields__}
        )

    @functools.cached_property
    def zones(self) -> list[Zone]:
        """Where the contact parts of the only body stick and slip in the plane; what is open is no
        zone."""
        mesh = self.meshes[self.only_body("zones")]
        if self.accuracy.zones is not None:  # as an adaptive solve places their ends
            return [Zone(*zone) for zone in self.accuracy.zones]
        zones: list[Zone] = []
        for name, pair in sorted(
            self.pairs.items(), key=lambda item: int(self.nodes[item[0]].min(initial=0))
        ):
            along = main_direction(pair.sigma_t)
            slips, pulls = (signed(x, along) for x in (pair.slip_increment, pair.sigma_t))
            way = np.sign(slips - 1e-300 * pulls)
            zones += zones_of(mesh, self.nodes[name], np.where(pair.state == SLIP, way, pair.state))
        return [zone for zone in zones if zone.sign != OPEN]

    @property
    def tension_share(self) -> float:
        """Part of Γ_C of the only body on which a foundation that does not pull would let go, σ_n >
        0 [-]."""
        contact = self.contact
        return float(contact.weight[contact.sigma_n > 0.0].sum() / contact.weight.sum())

    def reactions(self, step: StepResult | int | None = None) -> Keyed:
        """Resultant of the tractions on each part after an increment, the last one by default, (d,)
        each [stress · length, in space · area].

        Returns
        -------
        dict
            Arrays by part; of several bodies such a dict by body. Their sum is of the mesh's error.
        """
        resultants: dict[str, dict[str, Array]] = {}
        for name, mesh in self.meshes.items():
            forces = mesh.weight[:, None] * self.increment(step).bodies[name].traction
            resultants[name] = {
                part: forces[mesh.node_part == k].sum(axis=0)
                for k, part in enumerate(mesh.part_names)
            }
        return dict(resultants) if len(resultants) > 1 else dict(next(iter(resultants.values())))

    def until(self, number: int) -> Self:
        """Return the solution up to an increment, by its number from 1 on."""
        return replace(self, steps=self.steps[:number], failed=None)

    def to_dataframe(self, step: StepResult | int | None = None) -> DataFrame:
        """The nodes of all interfaces after an increment, the last one by default, as a pandas
        table.

        Columns x, y, u_t, sigma_t, slip, slip_increment (in space also z, and the components u_t_1,
        u_t_2, ...), arc_length, weight, sigma_n, friction_bound, gap, state, and the names part,
        body and pair.

        Raises
        ------
        MissingPackage
            If pandas is not installed; petcontact does without it. It is an ImportError.
        """
        try:
            import pandas
        except ImportError:
            raise MissingPackage("to_dataframe", "pandas", "tables") from None
        columns = self.columns(self.increment(step))
        table: dict[str, Array] = dict(zip("xyz", columns["x"].T, strict=False))
        for name in ("u_t", "sigma_t", "slip", "slip_increment"):
            table |= along_tangents(name, columns[name])
        names = (
            "arc_length",
            "weight",
            "sigma_n",
            "friction_bound",
            "gap",
            "state",
            "part",
            "body",
            "pair",
        )
        return pandas.DataFrame({**table, **{name: columns[name] for name in names}})

    def __repr__(self) -> str:
        title = f" {self.problem.title!r}" if self.problem.title else ""
        increments = f" in {len(self.tried)} increments" if len(self.tried) > 1 else ""
        bodies = f"{len(self.meshes)} bodies, " if len(self.meshes) > 1 else ""
        elements = sum(mesh.n_elements for mesh in self.meshes.values())
        nodes = sum(len(numbers) for numbers in self.nodes.values())
        return (
            f"<{type(self).__name__}{title}: {self.status} after {self.iterations} "
            f"iterations{increments}, {bodies}{elements} elements, {nodes} contact nodes>"
        )


def _once(table: Keyed) -> Keyed:
    """Return the rows of nodes that meet something, and one of each node that meets nothing."""
    if not table:
        return table
    kept, bodies = np.isfinite(table["gap"]), np.unique(table["body"], return_inverse=True)[1]
    order = np.argsort(~kept, kind="stable")
    places = np.column_stack([bodies, table["nodes"]])[order]
    kept[order[np.unique(places, axis=0, return_index=True)[1]]] = True
    return {key: values[kept] for key, values in table.items()}


def _no_rows(d: int) -> Keyed:
    """Columns of length 0, for a pair without nodes."""
    scalars = ("weight", "arc_length", "sigma_n", "friction_bound", "gap", "pressure", "worn_depth")
    shapes = {
        **dict.fromkeys(scalars, ()),
        **dict.fromkeys(("x", "normal"), (d,)),
        "tangent": (d - 1, d),
        **dict.fromkeys(("u_t", "sigma_t", "slip", "slip_increment"), (d - 1,)),
    }
    whole = {key: np.zeros(0, dtype=int) for key in ("nodes", "state")}
    words = {key: np.zeros(0, dtype=str) for key in ("part", "body", "pair")}
    return {**whole, **{key: np.zeros((0, *shape)) for key, shape in shapes.items()}, **words}
