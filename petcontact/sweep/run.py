"""Independent cases over MPI ranks: dealt out by group, logged as they finish, one table in the
end."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from ..errors import PetcontactError
from ..pipeline.steps.prepared import PreparedProblem
from ..results.solution import Solution
from ..runtime.mpi import all_meet, shared
from ..runtime.petsc import given_options
from ..runtime.ranks import begin_together
from ..runtime.signals import Interrupted
from ..untyped import Comm
from .design.identity import Identity, identify
from .design.sweep import Sweep
from .problems import prepared_for, run_case
from .progress import DONE, FAILED, Progress, Summary
from .quantities import Quantity, failed_row, row_of, users
from .schedule.cost import Cost, estimate
from .schedule.deal import Counters, WorkShare, dealt, make_parts
from .schedule.groups import Groups, describe, make_groups
from .schedule.rank_team import Team, TeamError, describe_error
from .store.case_table import derived, write_table
from .store.columns import texts
from .store.fields import DEPTH, packed
from .store.folder import SweepFolder
from .store.log import Log, records


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    world: Comm,
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
        The k-th of K parts, k = 1 ... K, which jobs of their own compute into one folder at the
        same time.
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
        On every rank, if the folder cannot be used, nothing matches `only`, or the ranks are called
        with different values.
    RanksError
        If a rank does not begin within 60 s (PETCONTACT_PATIENCE).
    TeamError, OutputError, OSError
        On one rank, if a result cannot be written or a team is torn: end the job with MPI_Abort.
    """
    begin_together(
        world,
        lambda: (
            lambda: {
                "sweep": repr(sweep.content),
                "folder": str(folder),
                "only": [*only],
                "part": part,
                "ranks_per_case": ranks_per_case,
                "force": force,
            }
        ),
    )
    began, began_cpu = time.perf_counter(), time.process_time()
    # of its own: a rank that meets an error and looks for the others must not find them waiting in
    # a barrier of the sweep
    world = world.Dup()
    team = Team(world, ranks_per_case)
    groups = make_groups(sweep)
    chosen = _chosen(sweep.only(only), groups, part)
    more = users(sweep.file.quantities, Path(sweep.source).parent, sweep.coordinate_names)
    place, name = SweepFolder(folder), f"{shared(world, time.time_ns):x}"
    identity = shared(world, lambda: identify(sweep, given_options(), more))
    running, remarks = shared(world, lambda: place.open(name))
    to_do = np.array(chosen, np.int64)
    if not force:
        to_do = np.setdiff1d(to_do, _finished(sweep, identity, place, world))
    costs = _costs(sweep, groups, world, team) if len(to_do) else []
    if world.Get_rank() == 0:
        place.write_index(sweep, identity)
        own = list(map(costs.__getitem__, np.unique(groups.of_case[to_do])))
        for line in describe(
            sweep,
            own,
            (len(chosen), len(chosen) - len(to_do), len(to_do), len(own)),
            team.count,
            ranks_per_case,
        ):
            say(line)
        for line in remarks:
            say(line)
    path = place.logs / f"{name}-{world.Get_rank():05d}.log"
    worker = _Worker(sweep, groups, team, Log(path), identity, more)
    worker.work(make_parts(to_do, groups.of_case, costs, team.count), Counters(running), world)
    logs = world.gather(
        (path, worker.timings if team.leads else {}, time.process_time() - began_cpu)
    )

    def conclude() -> Summary:
        summary = Summary(len(to_do), len(chosen) - len(to_do), results=place.table)
        _collect(summary, sweep, identity, place, chosen, logs, began)
        place.close(running)
        summary.seconds = time.perf_counter() - began
        summary.cpu[0] = time.process_time() - began_cpu
        return summary

    summary = shared(world, conclude)
    team.close()
    world.Free()
    return summary


def _collect(
    summary: Summary,
    sweep: Sweep,
    identity: Identity,
    place: SweepFolder,
    chosen: list[int],
    every: Sequence[tuple[Path, Mapping[str, float], float]],
    began: float,
) -> None:
    """Write results.h5 from the logs, and sum up what the ranks say: their log, their seconds by
    stage, their processor time."""
    since, cpu = time.perf_counter(), [seconds for *_, seconds in every]
    timings = Counter[str]()
    for _, stages, _ in every:
        timings.update(stages)
    with place.renewing():
        # logs by name, too: a network file system may show an old folder for a while
        logs = sorted({*place.log_files(), *(log for log, *_ in every)})
        table = derived(sweep, identity, logs)
        facts = {
            "ranks": len(cpu),
            "seconds": since - began,
            "timings": dict(sorted(timings.items())),
            "cpu": cpu,
        }
        write_table(place.table, sweep.file.title, sweep.coordinate_names, table, facts)
    for status, cases in (("failed", summary.failed), ("not converged", summary.not_converged)):
        bad = [k for k in chosen if table["status"][k] == status.encode()]
        cases.update(zip(texts(table["id"][bad]), texts(table["reason"][bad]), strict=True))
    collect = time.perf_counter() - since
    summary.cpu, summary.timings = cpu, {**dict(sorted(timings.items())), "collect": collect}


def _chosen(places: list[int], groups: Groups, part: tuple[int, int] | None) -> list[int]:
    """The places that belong to the k-th of K parts: whole groups, where there are enough."""
    if part is None:
        return places
    cases = len(groups.of_case)
    shares = groups.of_case if len(groups.first) >= 4 * part[1] else np.arange(cases)
    return [place for place in places if shares[place] % part[1] == part[0] - 1]


def _finished(sweep: Sweep, identity: Identity, folder: SweepFolder, world: Comm) -> list[int]:
    """Places of the cases that need not be computed again; the ranks share the look at the logs."""
    logs = shared(world, folder.log_files)
    finished = {
        number: {
            row["digest"]: row["status"] != "failed" and DEPTH[row["keep"]] >= DEPTH[sweep.keep]
            for row, *_ in records(logs[number], check=True)
        }
        for number in range(world.Get_rank(), len(logs), world.Get_size())
    }
    gathered = world.gather(finished)

    def places() -> list[int]:
        by_log = {number: ends for some in gathered for number, ends in some.items()}
        usable = {
            digest: end for number in sorted(by_log) for digest, end in by_log[number].items()
        }
        return [place for place in range(len(sweep)) if usable.get(identity.digest(place))]

    return shared(world, places)


def _costs(sweep: Sweep, groups: Groups, world: Comm, team: Team) -> list[Cost]:
    """The cost of each group, the same on every rank; every rank meshes its share."""
    asked = groups.first[groups.representatives()].tolist()
    own_costs = {
        k: estimate(sweep[asked[k]], team.size)
        for k in range(world.Get_rank(), len(asked), world.Get_size())
    }
    costs = {k: cost for some in world.allgather(own_costs) for k, cost in some.items()}
    return groups.spread([costs[k] for k in range(len(asked))])


class _Worker:
    """What this rank computes in one run of a sweep, and the seconds by stage that it takes."""

    def __init__(
        self,
        sweep: Sweep,
        groups: Groups,
        team: Team,
        log: Log,
        identity: Identity,
        more: dict[str, Quantity],
    ) -> None:
        self.sweep, self.groups, self.team, self.log = sweep, groups, team, log
        self.identity, self.more = identity, more
        self.timings = Counter[str]()
        self._group, self._reason = -1, ""
        self._prepared: PreparedProblem | None = None

    def work(self, parts: list[WorkShare], counters: Counters, world: Comm) -> None:
        """Compute what the team is dealt until nothing is left, and wait for the others."""
        self.log.written = lambda rows, failed: counters.count({DONE: rows, FAILED: failed})
        all_meet(world)
        cases = sum(len(part.places) for part in parts)
        told = Progress(counters, cases) if cases and world.Get_rank() == 0 else nullcontext()
        with told:
            batches = dealt(parts, counters)
            try:
                while (batch := self.team.decide(lambda: next(batches, None))) is not None:
                    for place in batch.tolist():
                        self._compute(place)
                self._prepare(-1)
            except (Interrupted, TeamError):
                self.log.flush()
                raise
            self.log.flush()
            all_meet(world)

    def _prepare(self, group: int, place: int = -1) -> None:
        """Make sure that this team holds the prepared problem of a group, and no other one; -1 is
        no group.

        It is that of the group's first case; where this one fails, which its loads may be the cause
        of, of the case at a place.
        """
        if group != self._group:
            if self._prepared is not None:
                self._prepared.close()
            self._group, self._prepared, self._reason = group, None, ""
            if group >= 0:
                self._eliminate(group, int(self.groups.first[group]))
        if group >= 0 and self._prepared is None and place != self.groups.first[group]:
            self._eliminate(group, place)

    def _eliminate(self, group: int, place: int) -> None:
        """Prepare a group by one of its cases."""
        size = int(self.groups.size[group])
        self._prepared, self._reason = self.team.attempt(
            lambda: prepared_for(self.sweep[place], self.team.comm, size)
        )
        if self._prepared is not None:
            self.timings.update(self._prepared.timings)

    def _compute(self, place: int) -> None:
        """One case from its config to its record."""
        self._prepare(int(self.groups.of_case[place]), place)
        prepared, reason, case = self._prepared, self._reason, None
        solution: Solution | None = None
        try:
            case = self.sweep[place]
        except PetcontactError as error:  # of a sweep too large to be validated before
            reason = str(error)
        if case is not None and not reason:
            solution, reason = self.team.attempt(lambda: run_case(prepared, case, self.team.comm))
        if solution is not None:
            own = set(solution.timings) if prepared is None else {"iterate", "check", "steps"}
            seconds = solution.timings
            self.timings.update({name: seconds[name] for name in own if name in seconds})
        if not self.team.leads:
            return
        began = time.perf_counter()
        id_, coordinates = self.sweep.ids[place], self.sweep.coordinates(place)
        row, fields, keep = failed_row(id_, coordinates, case, reason), b"", "scalars"
        if solution is not None:
            try:
                row = row_of(
                    id_, coordinates, solution, points=self.sweep.file.von_mises, more=self.more
                )
                fields, keep = packed(solution, self.sweep.keep), self.sweep.keep
            except Exception as error:  # a quantity of the user's may raise anything
                row = failed_row(id_, coordinates, case, f"quantities: {describe_error(error)}")
        self.log.add({"digest": self.identity.digest(place), **row, "keep": keep}, fields)
        self.timings.update({"write": time.perf_counter() - began})
