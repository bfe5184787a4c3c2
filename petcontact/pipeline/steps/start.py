"""Where a solve starts: after the increments of a result file, or from its last iterate, carried
over to these meshes."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...contact.state import Start
from ...errors import InputError
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...results.records import PairResult, StepResult
from ...results.solution import Solution, read_result
from .cycles import Row, rows_of
from .prepared import PreparedProblem
from .step_loop import known_factors

NAMES = ("zero", "frictionless")
ELSEWHERE = {
    "title",
    "units",
    "method",
    "bem",
    "petsc",
    "geometry",
    "mesh",
    "step",
    "cycle",
    "wear_coefficient",
    "wear_share",
}
"""Keys by which a problem may differ from that of a file it goes on from, or that are compared in
another way."""


def finished_before(
    problem: PreparedProblem, *, anew: bool = False
) -> tuple[list[StepResult], list[Row]]:
    """The converged increments of the file that `method.start` names, "FILE.h5" or "FILE.h5:k" for
    the first k, and its cycles.

    None if all are solved anew, or where the problem has no steps: then the file gives the first
    iterate.

    Raises
    ------
    InputError
        If there is no such file or increment, or it was solved with other meshes, data or steps.
    """
    name = problem.discrete.posed.method.start
    if anew or name in NAMES or not problem.discrete.posed.steps:
        return [], []
    file, colon, count = name.rpartition(":")
    file, count = (file, count) if colon and count.isdecimal() else (name, "")
    old = _read(file, name)
    meshes = zip(old.meshes.values(), problem.discrete.meshes, strict=False)
    same = all(mesh.x.shape == new.x.shape and np.allclose(mesh.x, new.x) for mesh, new in meshes)
    if not same or old.tried[0].alpha.size != problem.system.modes.shape[1]:
        raise InputError(
            f"method.start: {file} holds other bodies, pairs or meshes than this problem"
        )
    steps = [step for step in old.steps if step.status == "converged"]
    if count and not 0 < int(count) <= len(steps):
        raise InputError(
            f"method.start: {file} has {len(steps)} converged increments, got {name!r}"
        )
    steps = _whole_cycles(problem, file, steps[: int(count)] if count else steps)
    _check_posed(problem.discrete.config, old.problem.toml(), file, steps)
    _check_wear(problem, old, file, steps)
    return steps, rows_of(problem, old.wear, max((step.cycle for step in steps), default=0))


def _check_posed(config: str, before: str, file: str, done: list[StepResult]) -> None:
    """Refuse a problem in which the increments of a file are not those of its own first steps.

    Raises
    ------
    InputError
    """
    old, new = map(tomllib.loads, (before, config))
    count = max((result.step for result in done), default=0)
    if not old.get("step"):  # loads without steps are one, of this name and without changes
        old["step"] = [
            {key: [] for key, value in step.items() if isinstance(value, list)}
            | {"name": first.name}
            for step, first in zip(new.get("step", []), done[:1], strict=False)
        ]
    done_in, steps_now = (
        [{**step, "increments": 1} for step in tables.get("step", [])[:count]]
        for tables in (old, new)
    )
    for difference in (*_differences(old, new), *_differences(done_in, steps_now, "step")):
        raise InputError(
            f"method.start: {file} was solved with {difference}; what is done stays as it was "
            "posed, new steps follow its steps in the config"
        )


def _differences(old: object, new: object, key: str = "") -> Iterator[str]:
    """What two configs differ by, in words."""
    if isinstance(old, dict) and isinstance(new, dict):
        for name in sorted({*old, *new} - ELSEWHERE, key=lambda name: (name != "name", name)):
            yield from _differences(old.get(name), new.get(name), f"{key}.{name}" if key else name)
    elif (
        isinstance(old, list)
        and isinstance(new, list)
        and any(isinstance(item, dict) for item in old + new)
    ):
        for k, (old_item, new_item) in enumerate(zip_longest(old, new)):
            yield from _differences(old_item, new_item, f"{key}[{k}]")
    elif old is None or new is None:
        yield f"no {key}, which is here" if old is None else f"{key}, which is missing here"
    elif old != new:
        yield f"{key} = {old!r}, here it is {new!r}"


def _check_wear(
    problem: PreparedProblem, old: Solution, file: str, steps: list[StepResult]
) -> None:
    """Refuse another wear coefficient than the one by which a file's interfaces are worn.

    Raises
    ------
    InputError
    """
    before, now = (
        {side.name: side.law for side in posed.interfaces}
        for posed in (old.posed, problem.discrete.posed)
    )
    if not steps:
        return
    for name in now:
        worn = (wear := steps[-1].pairs[name].wear) is not None and wear.any()
        for key in ("wear_coefficient", "wear_share"):
            then, new = (getattr(laws[name], key) for laws in (before, now))
            if worn and then != new:
                raise InputError(
                    f"method.start: {file} has {name} worn with {key} = {then}, here it is {new}"
                )


def _whole_cycles(problem: PreparedProblem, file: str, steps: list[StepResult]) -> list[StepResult]:
    """The increments up to the end of the last cycle that is whole, where more are to follow. Steps
    that a file has once, without cycles, are those of the first cycle.

    Raises
    ------
    InputError
        If there are more cycles than the problem has.
    """
    posed = problem.discrete.posed
    numbers, most = posed.cycle_steps, max((step.cycle for step in steps), default=0)
    steps = [
        replace(step, cycle=1) if step.step in numbers and step.cycle == 0 else step
        for step in steps
    ]
    if posed.cycle is None or most <= 1:
        return steps
    if most > posed.cycle.count:
        raise InputError(
            f"method.start: {file} has {most} cycles, cycle.count is {posed.cycle.count}"
        )
    ends = [
        k for k, step in enumerate(steps) if step.step == numbers[-1] and step.load_factor == 1.0
    ]
    whole = steps[: ends[-1] + 1]
    return steps if whole[-1].cycle == posed.cycle.count else whole


def first_iterate(problem: PreparedProblem) -> Start | None:
    """v and σ of the file that `method.start` names, of a problem without steps; None for what goes
    by name.

    Raises
    ------
    InputError
        If there is no such file, or it holds other pairs.
    """
    name = problem.discrete.posed.method.start
    if name in NAMES or problem.discrete.posed.steps:
        return None
    file, colon, count = name.rpartition(":")
    if colon and count.isdecimal():
        raise InputError(
            f"method.start: a problem without [[step]] starts from all of a file, {file!r}, "
            f"got {name!r}"
        )
    return carried_over(problem, _read(name, name).last)


def start_within(
    problem: PreparedProblem, expected: Mapping[str, Callable[[Array], Mask]]
) -> Start | None:
    """Return a start without tractions that is closed where contact is expected, or None if it is
    expected nowhere.

    `expected` says by interface which points (n, 3) lie in contact. Other pairs overlap everywhere.
    """
    v = list[Array]()
    for side, interface in zip(problem.discrete.sides, problem.system.interfaces, strict=True):
        x = problem.discrete.meshes[side.body].x[interface.nodes]
        v.append(np.zeros((len(x), problem.system.k)))
        v[-1][:, -1] = 1.0
        if side.name in expected:
            v[-1][:, -1] = np.where(expected[side.name](x), 1.0, -1.0)
    return (np.concatenate(v), np.zeros((sum(map(len, v)), problem.system.k))) if expected else None


def following(problem: PreparedProblem, solution: Solution) -> PreparedProblem:
    """The problem with the increments of a solution on another mesh, each from where that ended."""
    discrete = problem.discrete.with_steps_of(solution.problem)
    starts, factors = starts_from(problem, solution.steps), known_factors(solution)
    return replace(problem, discrete=discrete, starts=starts, factors=factors)


def starts_from(
    problem: PreparedProblem, increments: Iterable[StepResult]
) -> dict[tuple[int, int, float], Callable[[], Start]]:
    """What returns `carried_over` of each increment, by step, cycle and load factor: few of them
    may be asked for."""
    return {
        (each.step, each.cycle, each.load_factor): functools.partial(carried_over, problem, each)
        for each in increments
    }


def carried_over(problem: PreparedProblem, old: StepResult) -> Start:
    """v and σ of an increment at the contact nodes of other meshes, pair by pair.

    Raises
    ------
    InputError
        If it has other pairs.
    """
    v = [np.zeros((0, problem.system.k))]
    sigma = v.copy()
    for side, face in zip(problem.discrete.sides, problem.system.interfaces, strict=True):
        if face.name not in old.pairs:
            raise InputError(
                f"method.start: the file holds no pair {face.name!r}; it has {', '.join(old.pairs)}"
            )
        pair, mesh = old.pairs[face.name], problem.discrete.meshes[side.body]
        near, share = _interpolation(mesh, pair, face.nodes)

        def there(values: Array, near: Index = near, share: Array = share) -> Array:
            return np.asarray(np.einsum("nk,nk...->n...", share, values[near]))

        slip, shear = (
            np.einsum("nk,nkd->nd", getattr(pair, key), pair.tangent)
            for key in ("slip_increment", "sigma_t")
        )
        moved, push = (
            np.einsum("nkd,nd->nk", face.tangent, there(vectors)) for vectors in (slip, shear)
        )
        if not face.held:
            gap = np.where(np.isfinite(pair.gap), pair.gap, 0.0)
            moved, push = (
                np.column_stack([a, there(b)]) for a, b in ((moved, -gap), (push, -pair.pressure))
            )
        v.append(moved)
        sigma.append(push)
    return np.concatenate(v), np.concatenate(sigma)


def _read(file: str, name: str) -> Solution:
    if not Path(file).is_file() and Path(file).suffix != ".h5":
        raise InputError(
            f'method.start: {name!r} is neither "zero", "frictionless" nor a result file (FILE.h5, '
            "FILE.h5:3 for 3 increments)"
        )
    try:
        return read_result(file)
    except InputError as error:
        raise InputError(f"method.start: {error}") from None


@functools.singledispatch
def _interpolation(mesh: BoundaryMesh, old: PairResult, nodes: Index) -> tuple[Index, Array]:
    """From which nodes of a pair values at some nodes of another mesh come, and their shares, (m,
    k) each: the nearest one, for each starts in one state."""
    nearest = scipy.spatial.cKDTree(old.x).query(mesh.x[nodes], k=[1])[1]
    return nearest, np.ones(nearest.shape)


@_interpolation.register
def _(mesh: CurveMesh, old: PairResult, nodes: Index) -> tuple[Index, Array]:
    """Linear in arc length, constant beyond the ends."""
    order = np.argsort(old.arc_length)
    old_s, s = old.arc_length[order], mesh.arc_length[nodes]
    after = np.clip(np.searchsorted(old_s, s), 1, max(len(old_s) - 1, 1)) % len(old_s)
    before = np.maximum(after - 1, 0)
    width = old_s[after] - old_s[before]
    share = np.clip(
        np.divide(s - old_s[before], width, out=np.zeros(len(s)), where=width > 0.0), 0.0, 1.0
    )
    return order[np.column_stack([before, after])], np.column_stack([1.0 - share, share])
