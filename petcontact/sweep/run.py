"""Independent cases over MPI ranks: claimed one by one, written as they finish, collected at the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..pipeline import run as pipeline
from ..pipeline.prepare import Prepared, prepare
from ..results.hdf5 import write_failure, write_solution
from ..results.solution import Solution
from ..runtime.mpi import all_meet, shared
from .cases import Sweep
from .cost import Group, describe, estimate, group_cases
from .folder import SweepFolder
from .progress import Progress
from .rank_team import Team
from .results_file import Collector


@dataclass
class Summary:
    """How a sweep ended.

    Attributes
    ----------
    computed, reused : int
        Cases of this run, and cases whose files were there.
    failed, not_converged : dict of str to str
        Reasons by case id, of this run and of reused files.
    seconds : float
        From the first look at the folder to results.h5 on the disk.
    ranks : int
    cpu : list of float
        Processor seconds of each rank in that time; a rank that waits sleeps.
    timings : dict of str to float
        Seconds by stage, summed over teams.
    results : Path
    """

    computed: int = 0
    reused: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    not_converged: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    ranks: int = 1
    cpu: list[float] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    results: Path = Path()

    @property
    def exit_status(self) -> int:
        """0 all converged, 3 some not converged, 1 some failed."""
        return 1 if self.failed else 3 if self.not_converged else 0

    def lines(self) -> list[str]:
        """A few lines for the user."""
        total = self.computed + self.reused
        converged = total - len(self.failed) - len(self.not_converged)
        split = ", ".join(f"{name} {seconds:.3f}" for name, seconds in self.timings.items())
        return [
            *(f"  failed: {id_}: {reason}" for id_, reason in self.failed.items()),
            *(f"  not converged: {id_}: {reason}" for id_, reason in self.not_converged.items()),
            f"  computed {self.computed}, reused {self.reused}, failed {len(self.failed)}"
            f" ({converged} converged, {len(self.not_converged)} not converged)",
            f"  {self.seconds:.3f} s on {self.ranks} rank{'s' * (self.ranks != 1)}; processor time a rank: mean "
            f"{sum(self.cpu) / max(1, len(self.cpu)):.3f} s, largest {max(self.cpu, default=0.0):.3f} s",
            f"  summed over the ranks [s]: {split}",
            f"  result: {self.results}",
        ]


def run_sweep(
    sweep: Sweep,
    folder: str | Path,
    world: Any,
    *,
    only: Sequence[str] = (),
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
        Made if it does not exist; case files are in its folder `cases`.
    world : mpi4py communicator
    only : sequence of str
        Shell patterns of the case ids to compute.
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
    ids = {case.id for case in sweep.only(only).cases}
    chosen = [k for k, case in enumerate(sweep.cases) if case.id in ids]
    place = SweepFolder(folder)
    shared(world, place.open)
    place.enter()
    run = _Run(sweep, place, world, team)
    finished = run.finished()
    to_do = [k for k in chosen if force or k not in finished]
    groups = run.estimate(group_cases(sweep.cases, to_do))
    if world.Get_rank() == 0:
        place.write_index(sweep)
        known = len(chosen) - len(to_do)
        for line in describe(groups, sweep.title, len(chosen), known, team.count, ranks_per_case):
            say(line)
    reused = finished - set(to_do)
    run.work(groups, reused)
    summary = run.conclude(Summary(len(to_do), len(reused & set(chosen)), ranks=world.Get_size()), chosen, began, began_cpu)
    place.close()
    team.close()
    world.Free()
    return summary


class _Run:
    """One run of a sweep on this rank."""

    def __init__(self, sweep: Sweep, folder: SweepFolder, world: Any, team: Team) -> None:
        self.sweep, self.folder, self.world, self.team = sweep, folder, world, team
        self.collector = Collector(folder, sweep) if world.Get_rank() == 0 else None
        self.timings: dict[str, float] = {}

    def finished(self) -> set[int]:
        """Places of the finished cases; every rank looks at its share of the files."""
        rank, ranks = self.world.Get_rank(), self.world.Get_size()
        mine = range(rank, len(self.sweep.cases), ranks)
        found = [k for k in mine if self.folder.is_finished(self.sweep.cases[k])]
        return {k for some in self.world.allgather(found) for k in some}

    def estimate(self, groups: Sequence[tuple[int, ...]]) -> list[Group]:
        """Size of each group; every rank meshes its share."""
        rank, ranks = self.world.Get_rank(), self.world.Get_size()
        mine = [(k, estimate(groups[k], self.sweep.cases[groups[k][0]].case, self.team.size))
                for k in range(rank, len(groups), ranks)]  # fmt: skip
        return [group for _, group in sorted(pair for some in self.world.allgather(mine) for pair in some)]

    def work(self, groups: Sequence[Group], reused: Set[int]) -> None:
        """Join groups until nothing is left to claim, and wait for the others."""
        all_meet(self.world)
        with Progress(self.folder.board, groups, enabled=self.collector is not None):
            while (number := self.team.decide(lambda: self.folder.board.next_group(groups))) is not None:
                self._work_on(groups[number])
            all_meet(self.world, meanwhile=lambda: self._collect(limit=1))
        self._collect(also=reused)

    def conclude(self, summary: Summary, chosen: Sequence[int], began: float, began_cpu: float) -> Summary:
        """results.h5 and the summary, by rank 0."""
        every = self.world.gather(self.timings if self.team.leads else {})
        cpu = self.world.gather(time.process_time() - began_cpu)

        def finish() -> Summary:
            assert self.collector is not None
            stages = {stage for timings in every for stage in timings}
            summary.timings = {stage: sum(timings.get(stage, 0.0) for timings in every) for stage in sorted(stages)}
            facts = {"ranks": summary.ranks, "seconds": time.perf_counter() - began, "timings": summary.timings, "cpu": cpu}
            summary.results = self.collector.finish(facts)
            for k in chosen:
                status, reason = self.collector.statuses[k]
                if status == "failed":
                    summary.failed[self.sweep.cases[k].id] = reason
                elif status == "not converged":
                    summary.not_converged[self.sweep.cases[k].id] = reason
            self.folder.clear_board()
            summary.seconds = time.perf_counter() - began
            summary.cpu = [time.process_time() - began_cpu, *cpu[1:]]
            return summary

        return shared(self.world, finish)

    def _work_on(self, group: Group) -> None:
        """Prepare a group once, then claim its cases one by one."""
        first = self.sweep.cases[group.cases[0]].case
        prepared, reason = self.team.attempt(lambda: prepare(first, self.team.comm, len(group.cases)))
        if prepared is not None:
            for name, seconds in prepared.timings.items():
                self._add(name, seconds)
        while (place := self.team.decide(lambda: self._claim(group))) is not None:
            self._solve(place, prepared, reason)
            self._collect(limit=2)
        if prepared is not None:
            prepared.close()

    def _claim(self, group: Group) -> int | None:
        return next((place for place in group.cases if self.folder.board.claim(place)), None)

    def _solve(self, place: int, prepared: Prepared | None, reason: str) -> None:
        """One case from its iteration to its file."""
        chosen = self.sweep.cases[place]
        solution: Solution | None = None
        if prepared is not None:
            solution, reason = self.team.attempt(lambda: pipeline.run(prepared, chosen.case))
        if solution is not None:
            for name in ("iterate", "check"):
                self._add(name, solution.timings[name])
        if not self.team.leads:
            return
        began = time.perf_counter()
        if solution is not None:
            write_solution(self.folder.case_file(chosen), solution)
        else:
            write_failure(self.folder.case_file(chosen), chosen.case, reason)
        self.folder.board.finish(place, failed=solution is None or solution.status == "failed")
        self._add("write", time.perf_counter() - began)

    def _collect(self, also: Set[int] = frozenset(), limit: int | None = None) -> None:
        """Copy finished cases into results.h5, on rank 0."""
        if self.collector is not None:
            began = time.perf_counter()
            self.collector.add(self.folder.board.read().done | also, limit)
            self._add("collect", time.perf_counter() - began)

    def _add(self, stage: str, seconds: float) -> None:
        self.timings[stage] = self.timings.get(stage, 0.0) + seconds


