"""PETSc options that no object asked for, and keys of a config that a solve does not read."""

from __future__ import annotations

import contextlib
import difflib
import re
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from ..model.problem import Problem


@contextlib.contextmanager
def unused_reported(first: bool) -> Iterator[None]:
    """Name the PETSc options that no object in the block asked for, also where it fails; after bad
    input nothing was solved."""
    try:
        yield
    except InputError:
        raise
    except BaseException:
        report_unused(first)
        raise
    report_unused(first)


def report_unused(first: bool) -> None:
    """Name the PETSc options that no object asked for, and the nearest of ours."""
    from ..given.tables.solver_options import Bem
    from ..manual import chapter
    from ..runtime.petsc import unused_options

    unused = unused_options() if first else []
    # PETSc lists no options that no object asked for; the manual names the usual ones
    named = re.findall(r"-[a-z]\w+", chapter("options")) if unused else []
    ours = [*(f"-bem_{name}" for name in Bem.model_fields), *sorted(set(named))]
    for name in unused:
        near = [] if name in ours else difflib.get_close_matches(name, ours, n=1)
        hint = f", did you mean {near[0]}?" if near else " (-help lists those that are)"
        print(f"petcontact: PETSc option {name} was not used by any object{hint}", file=sys.stderr)


def report_ignored(case: Problem, adaptive: bool, *, quiet: bool) -> None:
    """Name the keys of the config that the method that ran does not read."""
    method, keys = case.method, case.ignored(adaptive=adaptive)
    if keys and not quiet:
        who = "an adaptive solve" if adaptive else method.resolved_name
        rule = f" with rule {method.rule}" if method.rule and who == "projection" else ""
        print(f"petcontact: note: {who}{rule} does not use {', '.join(keys)}", file=sys.stderr)
