"""Independent cases over MPI ranks: claimed in shrinking chunks, journalled as they finish, one table in the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Index
from ..errors import PetcontactError
from ..pipeline.increment import PreparedProblem
from ..results.solution import Solution
from ..runtime.mpi import all_meet, shared
from ..runtime.petsc import petsc
from ..runtime.signals import Interrupted
from .design.identity import Identity
from .design.sweep import Sweep
from .problems import prepare_group, release, run_case
from .progress import Progress
from .quantities import Quantity, failed_row, row_of, users
from .schedule.chunks import Chunks, claimed, make_chunks
from .schedule.cost import Cost
from .schedule.counters import Counters, shared_counters
from .schedule.groups import Groups, describe, estimated, make_groups
from .schedule.rank_team import Team, TeamError, describe_error
from .store.columns import texts
from .store.finished import Finished, adopt_format1, bad_shards, look, read_all, refuse_another, settle, shards_of
from .store.folder import SweepFolder, remove
from .store.recorder import Recorder
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
        The k-th of K parts, k = 1 ... K, which jobs of their own compute into one folder at the same time. Their rows stay
        in journals until a run without a part brings them into the table.
    ranks_per_case : int
    force : bool
        Compute finished cases again, and drop the cases of another sweep.
    say : callable
        Gets the lines of the plan, on rank 0.

    Returns
    -------
    Summary
        The same on every rank.

    Raises
    ------
    InputError
        On every rank, if the folder cannot be used or holds another sweep, or nothing matches `only`.
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
    more = users(sweep.file.quantities, Path(sweep.source).parent)
    identity = Identity(sweep, petsc().Options().getAll(), more)
    place = SweepFolder(folder, part)
    token = shared(world, lambda: _opened(sweep, identity, place, force=force, parted=part is not None))
    place.enter()
    found, remarks = _finished(sweep, identity, place, world)
    to_do = [k for k in chosen if force or k not in found]
    run = _Run(sweep, groups, place, world, team, f"{token}-{world.Get_rank():05d}", identity, more)
    chunks, costs = run.plan(to_do)
    if world.Get_rank() == 0:
        place.write_index(sweep)
        here = np.unique(groups.of_case[to_do]) if to_do else []
        counts = (len(chosen), len(chosen) - len(to_do), len(to_do), len(here))
        for line in [*describe(sweep, [costs[g] for g in here], counts, team.count, ranks_per_case), *remarks]:
            say(line)
    run.work(chunks)
    summary = Summary(len(to_do), len(chosen) - len(to_do), ranks=world.Get_size())
    summary = run.conclude(summary, chosen, began, began_cpu, whole=part is None)
    place.close()
    team.close()
    world.Free()
    return summary


def _opened(sweep: Sweep, identity: Identity, folder: SweepFolder, *, force: bool, parted: bool) -> str:
    """Take the folder; a name for this run that no other has had. On rank 0."""
    refuse_another(sweep, folder, force)
    folder.open()
    token = f"{time.time_ns():x}"
    if not parted:
        adopt_format1(sweep, identity, folder, token)
    return token


def _finished(sweep: Sweep, identity: Identity, folder: SweepFolder, world: Any) -> tuple[set[int], list[str]]:
    """Places of the cases that can be used again, and remarks; the ranks share the look at the fields."""
    found: Finished = Finished()
    if world.Get_rank() == 0:
        found = look(sweep, identity, folder)
    shards = world.bcast(shards_of(found))
    mine = sorted(shards)[world.Get_rank() :: world.Get_size()]
    bad = [name for some in world.allgather(bad_shards(folder.path, mine)) for name in some]
    lost = {place for name in bad for place in shards[name]}
    damaged = [f"{name}: damaged or missing, its {len(shards[name])} cases are computed again" for name in bad]
    remarks = [*found.remarks, *damaged]
    return world.bcast(found.reusable) - lost, remarks


class _Run:
    """One run of a sweep on this rank."""

    def __init__(
        self, sweep: Sweep, groups: Groups, folder: SweepFolder, world: Any, team: Team, name: str, identity: Identity,
        more: dict[str, Quantity],
    ) -> None:  # fmt: skip
        self.sweep, self.groups, self.folder, self.world, self.team = sweep, groups, folder, world, team
        self.identity, self.more = identity, more
        self.timings: dict[str, float] = {}
        self.costs: list[Cost] = []
        self._name = name
        self._group, self._reason = -1, ""
        self._prepared: PreparedProblem | None = None

    def plan(self, to_do: Sequence[int]) -> tuple[Chunks, list[Cost]]:
        """The chunks, the same on every rank, and the cost of each group; every rank meshes its share."""
        rank, ranks = self.world.Get_rank(), self.world.Get_size()
        asked = self.groups.representatives() if len(to_do) else np.zeros(0, np.int64)
        mine = [(k, estimated(self.sweep, self.groups, int(asked[k]), self.team.size))
                for k in range(rank, len(asked), ranks)]  # fmt: skip
        known = dict(pair for some in self.world.allgather(mine) for pair in some)
        if not known:
            return make_chunks(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0), 1), []
        self.costs = costs = self.groups.spread([known[k] for k in range(len(asked))])
        places: Index = np.array(to_do, np.int64)
        case, prepare = (np.array([getattr(cost, name) for cost in costs]) for name in ("case", "prepare"))
        return make_chunks(places, self.groups.of_case[places], case, prepare, self.team.count), costs

    def work(self, chunks: Chunks) -> None:
        """Claim chunks until none is left, and wait for the others."""
        counters = shared_counters(self.world, self.folder.running)
        recorder = Recorder(self.folder, self.sweep.keep, self._name, counters.add) if self.team.leads else None
        all_meet(self.world)
        with Progress(counters, len(chunks.order), enabled=self.world.Get_rank() == 0):
            try:
                self._claim(chunks, counters, recorder)
            except (Interrupted, TeamError):
                if recorder is not None:
                    recorder.flush()
                raise
            if recorder is not None:
                self._timed("write", recorder.close)
            all_meet(self.world)
        counters.close()

    def _claim(self, chunks: Chunks, counters: Counters, recorder: Recorder | None) -> None:
        for number in claimed(len(chunks), self.team.number, self.team.count, lambda: self.team.decide(counters.next)):
            for place in chunks[number]:
                self._solve(place, recorder)
        self._prepare(-1)

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

    def _solve(self, place: int, recorder: Recorder | None) -> None:
        """One case from its config to its row."""
        group = int(self.groups.of_case[place])
        if recorder is not None:
            cost = self.costs[group]
            recorder.begin(cost.case + (cost.prepare if group != self._group else 0.0))
        self._prepare(group)
        prepared, reason = self._prepared, self._reason
        try:
            chosen = self.sweep[place]
        except PetcontactError as error:  # of a sweep too large to be validated before
            chosen, prepared, reason = None, None, str(error)
        solution: Solution | None = None
        if prepared is not None and chosen is not None:
            solution, reason = self.team.attempt(lambda: run_case(prepared, chosen.case))
        if solution is not None:
            for name in {"iterate", "check", "steps"} & set(solution.timings):
                self._add(name, solution.timings[name])
        if recorder is None:
            return
        began = time.perf_counter()
        id_, coordinates = self.sweep.ids[place], self.sweep.coordinates(place)
        case = None if chosen is None else chosen.case
        row = failed_row(id_, coordinates, case, reason)
        if solution is not None:
            try:
                row = row_of(id_, coordinates, solution, points=self.sweep.file.von_mises, more=self.more)
            except Exception as error:  # a quantity of the user's may raise anything
                row = failed_row(id_, coordinates, case, f"quantities: {describe_error(error)}")
        recorder.add({**row, "digest": self.identity.digest(place)}, solution)
        self._add("write", time.perf_counter() - began)

    def conclude(self, summary: Summary, chosen: Sequence[int], began: float, began_cpu: float, *, whole: bool) -> Summary:
        """The table and the summary, by rank 0."""
        every = self.world.gather(self.timings if self.team.leads else {})
        cpu = self.world.gather(time.process_time() - began_cpu)

        def finish() -> Summary:
            since = time.perf_counter()
            stages = {stage for timings in every for stage in timings}
            summary.timings = {stage: sum(timings.get(stage, 0.0) for timings in every) for stage in sorted(stages)}
            facts = {"ranks": summary.ranks, "seconds": since - began, "timings": summary.timings, "cpu": cpu}
            summary.results = self.folder.table if whole else self.folder.journals
            table = settle(self.sweep, self.identity, self.folder, facts).columns if whole else read_all(self.folder)[0]
            ends = zip(*(texts(table[name]) for name in ("id", "status", "reason")), strict=True) if table else ()
            last = {id_: (status, reason) for id_, status, reason in ends}
            for status, reason, id_ in ((*last.get(id_, ("", "")), id_) for id_ in map(self.sweep.ids.__getitem__, chosen)):
                if status in ("failed", "not converged"):
                    (summary.failed if status == "failed" else summary.not_converged)[id_] = reason
            remove(self.folder.running)
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
