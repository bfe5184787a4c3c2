"""Honesty of adaptive solves: "converged" and the reported error against the true one, by solves
that go further."""

from __future__ import annotations

import argparse
import concurrent.futures
import itertools
import math
import multiprocessing
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from petcontact import Problem, Solution
from petcontact.errors import PetcontactError
from petcontact.pipeline.adapt.budget import Reached
from petcontact.pipeline.adapt.difference import difference as traction_difference
from petcontact.pipeline.adapt.loop import AdaptiveSolve, strategy_for
from petcontact.pipeline.adapt.slip_ladder import contact_lines
from petcontact.refinement.contact_line import difference
from petcontact.refinement.marks import GradedOutline
from petcontact.results.evaluated import displacement_scale
from petcontact.runtime.petsc import petsc

HOLDS_NOT = "cannot be held"
"""Of the reason where a load has no equilibrium."""
REFERENCE = 0.3
"""Estimated error of the last mesh, over the accuracy, up to which it stands for the truth."""
HONEST, RANGE = 2.0, (1.0 / 30.0, 2.0)


@dataclass(frozen=True)
class Outcome:
    """One body at one accuracy."""

    number: int
    accuracy: float
    status: str
    estimate: float
    true: float
    reference: float
    seconds: float

    @property
    def ratio(self) -> float:
        """True error over the estimate; 1 where both are of round-off, as where everything
        sticks."""
        return (
            1.0 if max(self.true, self.estimate) < 1e-12 else self.true / max(self.estimate, 1e-300)
        )


@dataclass(frozen=True)
class Climb:
    """Solutions on meshes one after another, each with its estimate and the seconds until then; why
    there are no more."""

    levels: Any
    shown: list[tuple[Solution, float, float]]
    reason: str
    seconds: float

    @staticmethod
    def to(case: Problem, accuracy: float) -> Climb:
        """Until the estimate meets an accuracy."""
        began, shown = time.process_time(), list[tuple[Solution, float, float]]()

        def reached(mesh: Reached) -> None:
            vague = work.missed > 0.0
            estimate = math.inf if vague else mesh.estimate
            shown.append((mesh.solution, estimate, time.process_time() - began))

        work = AdaptiveSolve(case, petsc().COMM_WORLD, accuracy, (None, None, reached))
        try:
            work.climb()
            reason = work.trouble
        except PetcontactError as error:
            reason = str(error)
        if work.solutions and work.solutions[-1].status != "converged":
            reason = work.solutions[-1].reason
        levels = getattr(work.strategy, "levels", None)
        return Climb(levels, shown, reason, time.process_time() - began)


Draw = Callable[[int, int], Problem]
"""The problem of a seed and a number."""


def solved(
    draw: Draw, seed: int, number: int, accuracies: list[float], reference: float
) -> list[Outcome]:
    """A problem at every accuracy; the error is that of p and q, of one body in bilateral contact
    that of u_t."""
    case = draw(seed, number)
    finest = Climb.to(case, reference)
    if not finest.shown:
        status = "nothing holds it" if HOLDS_NOT in finest.reason else f"failed: {finest.reason}"
        return [
            Outcome(number, a, status, math.inf, math.nan, math.inf, finest.seconds)
            for a in accuracies
        ]
    best, known, _ = finest.shown[-1]
    result = []
    for accuracy in accuracies:
        levels = getattr(strategy_for(case.posed, accuracy), "levels", None)
        shown = finest.shown if levels == finest.levels else Climb.to(case, accuracy).shown
        solution, estimate, seconds = next((row for row in shown if row[1] <= accuracy), shown[-1])
        # what the last mesh alone reaches has nothing better to be compared with
        true = math.nan
        if solution is not best:
            true = (
                traction_difference(solution, best).inside
                if case.contact
                else true_error(solution, best)
            )
        status = "converged" if estimate <= accuracy else "not converged"
        result.append(Outcome(number, accuracy, status, estimate, true, known, seconds))
    return result


def true_error(solution: Solution, best: Solution) -> float:
    """Of u_t in L2(Γ_C), relative, seen from the nodes of both."""
    body = GradedOutline.from_body(solution.problem.bodies[0], solution.problem.geometry.outline())
    return difference(
        contact_lines(body, solution), contact_lines(body, best)
    ) / displacement_scale(best)


def campaign(draw: Draw, arguments: argparse.Namespace, reference: float) -> None:
    """Solve problems and print the table; arguments are those of `add_arguments`, `reference` is
    the default accuracy of the last mesh over the smallest one."""
    reference = arguments.reference or reference * min(arguments.accuracy)
    jobs = [
        (draw, arguments.seed, number, arguments.accuracy, reference)
        for number in range(arguments.first, arguments.first + arguments.number)
    ]
    outcomes: list[Outcome] = []
    end = time.monotonic() + 60.0 * arguments.minutes
    # fresh processes: PETSc and MPI do not survive a fork
    with concurrent.futures.ProcessPoolExecutor(
        arguments.processes, multiprocessing.get_context("spawn")
    ) as pool:
        for rows in (
            itertools.starmap(solved, jobs)
            if arguments.processes == 1
            else pool.map(solved, *zip(*jobs, strict=True))
        ):
            outcomes += rows
            for outcome in rows if arguments.show else []:
                show(outcome)
            if time.monotonic() > end:
                pool.shutdown(cancel_futures=True)
                break
    print_table(outcomes, arguments.accuracy)


def add_arguments(parser: argparse.ArgumentParser, number: int, accuracies: list[float]) -> None:
    """What a campaign asks for, with its defaults."""
    parser.add_argument("--number", type=int, default=number, help="of problems")
    parser.add_argument("--first", type=int, default=0, help="number of the first problem")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--accuracy", type=float, nargs="+", default=accuracies)
    parser.add_argument("--reference", type=float, help="accuracy of the last mesh")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument(
        "--minutes", type=float, default=math.inf, help="after which no further problem is begun"
    )
    parser.add_argument(
        "--show", action="store_true", help="a line for each outcome that is not as it should be"
    )


def show(outcome: Outcome) -> None:
    """A line for an outcome that is not as it should be."""
    ratio = outcome.ratio
    if outcome.status == "nothing holds it":
        return
    if (
        outcome.status != "converged"
        or outcome.true > min(outcome.accuracy, outcome.estimate)
        or not RANGE[0] <= ratio <= RANGE[1]
    ):
        print(
            f"problem {outcome.number} at {outcome.accuracy:g}: {outcome.status}, true "
            f"{outcome.true:.1e}, estimated {outcome.estimate:.1e} (reference "
            f"{outcome.reference:.1e}), {outcome.seconds:.2f} s",
            flush=True,
        )


def print_table(outcomes: list[Outcome], accuracies: list[float]) -> None:
    print(
        "| wanted | problems | nothing holds | converged | with a reference | true <= wanted | <= 2 "
        "x wanted | true <= reported | true/estimate in [1/30, 2] "
        "| true/estimate 1 / 50 / 90 / 99 % | seconds 50 / 90 % |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for accuracy in accuracies:
        drawn = [outcome for outcome in outcomes if outcome.accuracy == accuracy]
        mine = [outcome for outcome in drawn if outcome.status != "nothing holds it"]
        converged = [outcome for outcome in mine if outcome.status == "converged"]
        known = [
            o for o in converged if o.reference <= REFERENCE * accuracy and math.isfinite(o.true)
        ]
        true = np.array([outcome.true for outcome in known] or [np.nan]) / accuracy
        ratio = np.array([outcome.ratio for outcome in known] or [np.nan])
        share = np.percentile(ratio, [1, 50, 90, 99])
        seconds = np.percentile([outcome.seconds for outcome in mine] or [np.nan], [50, 90])
        held = [
            true <= 1.0,
            true <= HONEST,
            ratio <= 1.0,
            (ratio >= RANGE[0]) & (ratio <= RANGE[1]),
        ]
        cells = [
            f"{accuracy:g}",
            f"{len(drawn)}",
            f"{len(drawn) - len(mine)}",
            f"{len(converged) / max(1, len(mine)):.3f}",
            f"{len(known)}",
            *(f"{np.mean(right):.3f}" if known else "" for right in held),
            " / ".join(f"{value:.2g}" for value in share),
            " / ".join(f"{value:.2f}" for value in seconds),
        ]
        print(f"| {' | '.join(cells)} |")
