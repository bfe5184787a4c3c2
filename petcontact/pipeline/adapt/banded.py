"""Meshes whose panels follow contacts: forecast from the shapes, then from solutions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence

import numpy as np

from ...arrays import connected
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ...record import replace
from ...refinement.panels.bands import LEVELS, Laid, banded
from ...refinement.panels.face_gaps import opposite
from ...refinement.panels.zone import STRIP, ContactBand, ContactEllipse, Zone
from ...results.records import step_ends
from ...results.solution import Solution
from .expected import Expected
from .known_forces import is_held, known_force, way_of
from .long_contacts import LEFT, UNKNOWN, LaidBands, ZonedContact, followed

ERRORS: dict[type, tuple[float, ...]] = {
    ContactBand: (0.052 * LEFT, 0.033 * LEFT),
    ContactEllipse: (0.104, 0.037, 0.02),
}
"""Error of p with none, one and more lines between the ridge and the edge: of Hertz' ellipse 1:20
by the change with one more line, which has to come; of his circle, with one ring more, by tails
(scripts/verify_space --only adaptive)."""
Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]


Made = tuple[list[SurfaceMesh], LaidBands]
"""Meshes with bands, or none, and all bands."""


class Bands:
    """Lays bands along long contacts, and rings around compact ones.

    Without rings, panels as narrow at a circular edge are nine times as many. Their error is
    larger, since p is a square root at the edge, which no polynomial across the edge follows.

    Parameters
    ----------
    posed : Posed
    wanted : float
        The wanted accuracy [-].

    Attributes
    ----------
    faces : int
        Number of faces that may have bands.
    """

    def __init__(self, posed: Posed, wanted: float) -> None:
        self._posed, self._wanted, self._expected = posed, wanted, Expected(posed)
        together = connected({k: side.ends for k, side in enumerate(posed.interfaces)})
        self._groups = [
            group
            for group in ([posed.interfaces[k] for k in numbers] for numbers in together)
            if all(side.law.normal == "unilateral" for side in group)
        ]
        self._sides = [side for group in self._groups for side in group]
        self.faces = len({end for side in self._sides for end in side.ends})

    def first(self, meshes: Sequence[SurfaceMesh], completed: Completed) -> Made:
        """Return first meshes with bands where forces of contacts are known, else none.

        They have so many lines that one more line reaches the wanted error."""
        forces = {side.name: known_force(self._posed, side, meshes) for side in self._sides}
        known = {name: force for name, force in forces.items() if force}
        return self._more(LaidBands(), meshes, known, completed)

    def next(
        self,
        laid: LaidBands,
        solution: Solution,
        meshes: Sequence[SurfaceMesh],
        completed: Completed,
    ) -> Made:
        """Return meshes with bands that follow a solution, with more lines than before, or none."""
        steps, forces = step_ends(solution.steps or solution.tried), dict[str, float]()
        shared = {k: self._shared(side, meshes) for k, side in enumerate(self._sides)}
        for group in ([self._sides[k] for k in numbers] for numbers in connected(shared)):
            for side in group:
                pairs = [step.pairs[side.name] for step in steps]
                forces[side.name] = max(float(pair.weight @ pair.pressure) for pair in pairs)
            if not any(forces[side.name] for side in group):
                forces |= self._of_overlaps(group, solution, meshes)
                laid = replace(laid, most=0)  # such bands show where the next ones lie
        return self._more(laid, meshes, forces, completed, solution)

    def _more(
        self,
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        completed: Completed,
        solution: Solution | None = None,
    ) -> Made:
        """Return meshes with one line more in each band, or none if no band is new.

        First bands that cost too much have two lines less: the next ones then cost less, too, and
        show the error.
        """
        while True:
            for sticks in (True, False) if solution is not None else (False,):
                made, new = self._one_more(laid, meshes, forces, solution, sticks)
                grown = [name for name, rows in new.lines.items() if rows != laid.lines.get(name)]
                made = completed(made) if grown else []
                if made:
                    return made, new
            laid = replace(laid, long=new.long | laid.long)
            used = max((new.lines[name][-1] for name in grown), default=0)
            if laid.lines or not used:
                return [], laid
            laid = replace(laid, most=max(used - 2, 0))

    def _one_more(
        self,
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
        sticks: bool,
    ) -> Made:
        """Return meshes with one line more in each band."""
        made = [*meshes]
        for group in self._groups:
            known, longs = self._longs(group, laid, meshes, forces, solution, sticks)
            laid = replace(laid, long=known)
            own = {name: self._lines(laid, own) for name, own in longs.items()}
            new = self._on_all(made, longs, own)
            if new is not None:
                made = new
                laid = replace(laid, long={**laid.long, **longs}, lines=laid.lines | own)
        return made, laid

    def _lines(self, laid: LaidBands, longs: Sequence[ZonedContact]) -> tuple[int, ...]:
        """Return the numbers of lines of a contact up to the next band: as many as reach the wanted
        error, or one more than before; those before if there is no next one.

        First rings show where a contact and its stick end. Later ones follow these edges, with one
        number of lines until they stay, twice at most.
        """
        side, is_band = longs[0].side, any(long.is_band for long in longs)
        lines = laid.lines.get(side.name, ())
        errors = itertools.zip_longest(*(ERRORS[type(long.zone)] for long in longs), fillvalue=0.0)
        needed = sum(max(each) > self._wanted for each in errors)
        if not lines or laid.has_band(side.name) > is_band:
            first = 0 if side.rubs and not is_band else min(needed, laid.most)
            return (*lines, first)
        stays = _stay(laid.long[side.name], longs)
        more = lines[-1] + (is_band or stays or lines[1:].count(lines[-1]) > 1)
        more = more if is_band else max(more, needed)
        return (*lines, more) if more < LEVELS else lines

    def _longs(
        self,
        group: Sequence[PosedInterface],
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
        sticks: bool,
    ) -> tuple[dict[str, list[ZonedContact]], dict[str, list[ZonedContact]]]:
        """Return what is known of contacts, and those of a group that carry anything; none of them
        if one has no zone."""
        known, result = dict(laid.long), dict[str, list[ZonedContact]]()
        for side in group:
            force = forces.get(side.name, 0.0)
            if force > 0.0 and side.name not in known:
                known[side.name] = self._expected.zones(side, force, meshes, solution)
            longs = known[side.name] if force > 0.0 else []
            if force > 0.0 and solution is not None:
                longs = self._seen(side, longs, side.name in laid.lines, solution, sticks)
            if longs:
                result[side.name] = longs
            elif force > 0.0 or solution is None:
                return known, {}
        return known, result

    def _seen(
        self,
        side: PosedInterface,
        longs: list[ZonedContact],
        laid: bool,
        solution: Solution,
        sticks: bool,
    ) -> list[ZonedContact]:
        """Return a contact as a solution has it, or as it is expected where a mesh without bands or
        rings sees less of it: finite bodies differ from half spaces."""
        if not laid and any(long.is_band for long in longs):
            return longs
        asked = longs or self._unknown(side, solution)
        seen = followed(asked, solution, side.name, sticks)
        return seen if laid or len(seen) == len(asked) else longs

    def _unknown(self, side: PosedInterface, solution: Solution) -> list[ZonedContact]:
        """Return a contact where p is largest, without a zone, or none if it has no charts."""
        pair = step_ends(solution.steps or solution.tried)[-1].pairs[side.name]
        charts = self._expected.charts(side, pair.x[int(pair.pressure.argmax())])
        return [ZonedContact(side, charts, UNKNOWN)] if charts else []

    def _on_all(
        self,
        meshes: Sequence[SurfaceMesh],
        longs: Mapping[str, list[ZonedContact]],
        lines: Mapping[str, tuple[int, ...]],
    ) -> list[SurfaceMesh] | None:
        """Return meshes with the bands of a group on all its faces, or None without such."""
        laid, result = dict[tuple[int, str], list[Laid]](), [*meshes]
        for name, long in ((name, long) for name, own in longs.items() for long in own):
            for end, chart, zone in zip(long.side.ends, long.charts, zones_of(long), strict=True):
                laid.setdefault(end, []).append((chart, zone, lines[name][-1]))
        for (body, part), bands in laid.items():
            mesh = banded(result[body], part, *bands)
            if mesh is None:
                return None
            result[body] = mesh
        return result if laid else None

    def _shared(self, side: PosedInterface, meshes: Sequence[SurfaceMesh]) -> set[Hashable]:
        """Return the faces of a contact, and its bodies that move along it as a whole: these close
        one contact as far as they open another one."""
        way = way_of(self._posed, side)
        if way is None:
            return {*side.ends}
        loose = (b for b in side.bodies if not is_held(self._posed, b, meshes[b], way))
        return {*side.ends, *loose}

    def _of_overlaps(
        self, group: Sequence[PosedInterface], solution: Solution, meshes: Sequence[SurfaceMesh]
    ) -> dict[str, float]:
        """Return the forces that end overlaps between nodes, which contacts of a group share: a
        roller may be pressed into one of two plates before it moves."""
        step = step_ends(solution.steps or solution.tried)[-1]
        known = [
            self._expected.overlap(side, step.pairs[side.name], meshes, solution) for side in group
        ]
        depth = sum(known) / len(group)
        if not 0.0 < depth < math.inf:
            return {}
        forces = {side.name: self._expected.force(side, depth, meshes, solution) for side in group}
        return {name: force for name, force in forces.items() if force > 0.0}


def _stay(before: Sequence[ZonedContact], after: Sequence[ZonedContact]) -> bool:
    """Return whether zones are where those before them are, up to what solutions tell apart."""
    zones = [[long.zone for long in longs] for longs in (before, after)]
    return len(before) == len(after) and all(
        isinstance(old, ContactEllipse)
        and isinstance(new, ContactEllipse)
        and old.moved_by(new) < STRIP
        for old, new in zip(*zones, strict=True)
    )


def zones_of(long: ZonedContact) -> list[Zone]:
    """Return the zone on the secondary, and the same zone on the primary, if that is a body."""
    own, zone = long.charts[0], long.zone
    if len(long.charts) == 1:
        return [zone]
    chart = long.charts[1]
    x, normal = own.at(zone.points), own.normal(zone.points)
    places = opposite(chart, x, normal, long.side.direction)[0]
    if chart.wraps:  # a band that goes round ends where it begins
        period = chart.high[0] - chart.low[0]
        places[:, 0] = np.unwrap(places[:, 0], period=period)
        places[:, 0] -= period * np.floor((places[:, 0].mean() - chart.low[0]) / period)
    return [zone, zone.moved(places)]
