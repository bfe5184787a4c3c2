"""Independent cases over MPI ranks: dealt out by group, logged as they finish, one table in the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Index
from ..errors import PetcontactError
from ..runtime.mpi import all_meet, shared
from ..runtime.petsc import petsc
from ..runtime.signals import Interrupted
from .design.identity import Identity, identify
from .design.sweep import Sweep
from .problems import AnySolution, Shared, prepare_group, release, run_case
from .progress import DONE, FAILED, Progress
from .quantities import Quantity, failed_row, row_of, users
from .schedule.cost import Cost
from .schedule.deal import Counters, Part, dealt, make_parts
from .schedule.groups import Groups, describe, estimated, make_groups
from .schedule.rank_team import Team, TeamError, describe_error
from .store.case_table import derived, write_table
from .store.columns import texts
from .store.fields import DEPTH, packed
from .store.folder import SweepFolder
from .store.log import Log, records
from .summary import Summary


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    world: Any,
    *,
    only: Sequence[str] = (),
    part: tuple[int, int] | None = None,
    ranks_per_case: int = 1,
    force: bool = False,
    say: Callable[[str], None] = print,
) -> Summary:
    """Compute what is not finished; collective over `world`.

    Parameters
    ----------
    sweep : Sweep
        The same on every rank.
    folder : str or Path
        Made if it does not exist.
    world : mpi4py communicator
    only : sequence of str
        Shell patterns of the case ids to compute.
    part : (k, K), optional
        The k-th of K parts, k = 1 ... K, which jobs of their own compute into one folder at the same time.
    ranks_per_case : int
    force : bool
        Compute finished cases again.
    say : callable
        Gets the lines of the plan, on rank 0.

    Returns
    -------
    Summary
        The same on every rank.

    Raises
    ------
    InputError
        On every rank, if the folder cannot be used or nothing matches `only`.
    TeamError, OutputError, OSError
        On one rank, if a result cannot be written or a team is torn: end the job with MPI_Abort.
    """
    began, began_cpu = time.perf_counter(), time.process_time()
    # of its own: a rank that meets an error and looks for the others must not find them waiting in a barrier of the sweep
    world = world.Dup()
    team = Team(world, ranks_per_case)
    chosen = sweep.only(only)
    groups = make_groups(sweep)
    if part is not None:
        # whole groups go to one part, where there are enough of them
        shares = np.asarray(groups.of_case if len(groups.first) >= 4 * part[1] else np.arange(len(sweep)))
        chosen = [place for place in chosen if shares[place] % part[1] == part[0] - 1]
    more = users(sweep.file.quantities, Path(sweep.source).parent, sweep.coordinate_names)
    place = SweepFolder(folder)
    name = f"{shared(world, time.time_ns):x}"
    identity = shared(world, lambda: identify(sweep, petsc().Options().getAll(), more))
    running, remarks = shared(world, lambda: place.open(name))
    found = _finished(sweep, identity, place, world)
    to_do = [k for k in chosen if force or k not in found]
    log = Log(place.logs / f"{name}-{world.Get_rank():05d}.log")
    run = _Run(sweep, groups, place, world, team, log, identity, more)
    parts, costs = run.plan(to_do)
    if world.Get_rank() == 0:
        place.write_index(sweep, identity)
        here = np.unique(groups.of_case[to_do]) if to_do else []
        counts = (len(chosen), len(chosen) - len(to_do), len(to_do), len(here))
        for line in [*describe(sweep, [costs[g] for g in here], counts, team.count, ranks_per_case), *remarks]:
            say(line)
    run.work(parts, running)
    summary = run.conclude(Summary(len(to_do), len(chosen) - len(to_do), ranks=world.Get_size()), chosen, began, began_cpu)
    if world.Get_rank() == 0:
        place.close(running)
    team.close()
    world.Free()
    return summary


def _finished(sweep: Sweep, identity: Identity, folder: SweepFolder, world: Any) -> set[int]:
    """Places of the cases that need not be computed again; the ranks share the look at the logs."""
    logs = shared(world, folder.log_files)
    mine = {}
    for number in range(world.Get_rank(), len(logs), world.Get_size()):
        mine[number] = {row["digest"]: row["status"] != "failed" and DEPTH[row["keep"]] >= DEPTH[sweep.keep]
                        for row, *_ in records(logs[number], check=True)}  # fmt: skip
    every = world.gather(mine)

    def places() -> set[int]:
        by_log = {number: ends for some in every for number, ends in some.items()}
        usable = {digest: end for number in sorted(by_log) for digest, end in by_log[number].items()}
        return {place for place in range(len(sweep)) if usable.get(identity.digest(place))}

    return shared(world, places)


class _Run:
    """One run of a sweep on this rank."""

    def __init__(
        self, sweep: Sweep, groups: Groups, folder: SweepFolder, world: Any, team: Team, log: Log, identity: Identity,
        more: dict[str, Quantity],
    ) -> None:  # fmt: skip
        self.sweep, self.groups, self.folder, self.world, self.team = sweep, groups, folder, world, team
        self.identity, self.more = identity, more
        self.timings: dict[str, float] = {}
        self.costs: list[Cost] = []
        self.log = log
        self._group, self._reason = -1, ""
        self._prepared: Shared | None = None

    def plan(self, to_do: Sequence[int]) -> tuple[list[Part], list[Cost]]:
        """The parts to deal out, the same on every rank, and the cost of each group; every rank meshes its share."""
        if not to_do:
            return [], []
        rank, ranks = self.world.Get_rank(), self.world.Get_size()
        asked = self.groups.representatives()
        mine = {k: estimated(self.sweep, self.groups, int(asked[k]), self.team.size) for k in range(rank, len(asked), ranks)}
        known = {k: cost for some in self.world.allgather(mine) for k, cost in some.items()}
        self.costs = self.groups.spread([known[k] for k in range(len(asked))])
        places: Index = np.array(to_do, np.int64)
        case, prepare = (np.array([getattr(cost, name) for cost in self.costs]) for name in ("case", "prepare"))
        return make_parts(places, self.groups.of_case[places], case, prepare, self.team.count), self.costs

    def work(self, parts: list[Part], running: Path) -> None:
        """Compute what this team is dealt until nothing is left, and wait for the others."""
        counters = Counters(running)
        self.log.written = lambda rows, failed: counters.count({DONE: rows, FAILED: failed})
        all_meet(self.world)
        with Progress(counters, sum(len(part.places) for part in parts), enabled=self.world.Get_rank() == 0):
            try:
                batches = dealt(parts, counters)
                while (batch := self.team.decide(lambda: next(batches, None))) is not None:
                    for place in batch.tolist():
                        self._solve(place)
                self._prepare(-1)
            except (Interrupted, TeamError):
                self.log.flush()
                raise
            self._timed("write", self.log.flush)
            all_meet(self.world)

    def _prepare(self, group: int) -> None:
        """Make sure that this team holds the prepared problem of a group, and no other one; -1 is no group."""
        if group == self._group:
            return
        if self._prepared is not None:
            release(self._prepared)
        self._group, self._prepared, self._reason = group, None, ""
        if group < 0:
            return
        first, size = int(self.groups.first[group]), int(self.groups.size[group])
        self._prepared, self._reason = self.team.attempt(
            lambda: prepare_group(self.sweep[first].case, self.team.comm, size)
        )
        if self._prepared is not None:
            for name, seconds in self._prepared.timings.items():
                self._add(name, seconds)

    def _solve(self, place: int) -> None:
        """One case from its config to its row."""
        group = int(self.groups.of_case[place])
        cost = self.costs[group]
        self.log.begin(cost.case + (cost.prepare if group != self._group else 0.0))
        self._prepare(group)
        prepared, reason = self._prepared, self._reason
        try:
            chosen = self.sweep[place]
        except PetcontactError as error:  # of a sweep too large to be validated before
            chosen, prepared, reason = None, None, str(error)
        solution: AnySolution | None = None
        if prepared is not None and chosen is not None:
            solution, reason = self.team.attempt(lambda: run_case(prepared, chosen.case))
        if solution is not None:
            for name in {"iterate", "check", "steps"} & set(solution.timings):
                self._add(name, solution.timings[name])
        if not self.team.leads:
            return
        began = time.perf_counter()
        id_, coordinates = self.sweep.ids[place], self.sweep.coordinates(place)
        case = None if chosen is None else chosen.case
        row, fields, keep = failed_row(id_, coordinates, case, reason), b"", "scalars"
        if solution is not None:
            try:
                row = row_of(id_, coordinates, solution, points=self.sweep.file.von_mises, more=self.more)
                fields, keep = packed(solution, self.sweep.keep), self.sweep.keep
            except Exception as error:  # a quantity of the user's may raise anything
                row = failed_row(id_, coordinates, case, f"quantities: {describe_error(error)}")
        self.log.add({"digest": self.identity.digest(place), **row, "keep": keep}, fields)
        self._add("write", time.perf_counter() - began)

    def conclude(self, summary: Summary, chosen: Sequence[int], began: float, began_cpu: float) -> Summary:
        """The table and the summary, by rank 0."""
        every = self.world.gather(self.timings if self.team.leads else {})
        cpu = self.world.gather(time.process_time() - began_cpu)
        # by name, too: a network file system may show an old folder for a while
        logs = self.world.gather(self.log.path)

        def finish() -> Summary:
            since = time.perf_counter()
            stages = {stage for timings in every for stage in timings}
            summary.timings = {stage: sum(timings.get(stage, 0.0) for timings in every) for stage in sorted(stages)}
            facts = {"ranks": summary.ranks, "seconds": since - began, "timings": summary.timings, "cpu": cpu}
            with self.folder.renewing():
                table = derived(self.sweep, self.identity, sorted({*self.folder.log_files(), *logs}))
                write_table(self.folder.table, self.sweep.title, self.sweep.coordinate_names, table, facts)
            bad = [place for place in chosen if table["status"][place] in (b"failed", b"not converged")]
            for status, reason, id_ in zip(*(texts(table[name][bad]) for name in ("status", "reason", "id")), strict=True):
                (summary.failed if status == "failed" else summary.not_converged)[id_] = reason
            summary.results = self.folder.table
            summary.timings["collect"] = time.perf_counter() - since
            summary.seconds = time.perf_counter() - began
            summary.cpu = [time.process_time() - began_cpu, *cpu[1:]]
            return summary

        return shared(self.world, finish)

    def _timed(self, stage: str, work: Callable[[], None]) -> None:
        began = time.perf_counter()
        work()
        self._add(stage, time.perf_counter() - began)

    def _add(self, stage: str, seconds: float) -> None:
        self.timings[stage] = self.timings.get(stage, 0.0) + seconds
