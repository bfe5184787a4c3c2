"""A sweep: problems, variants and axes crossed. Cases are made when they are asked for: a million
of them take no memory."""

from __future__ import annotations

import copy
import fnmatch
import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...given.tables.base import parse
from ...model.case import files_in, parse_problem
from ...model.problem import Problem
from ...record import record
from ...untyped import Keyed
from .axes import full_key, make_axes, value_word
from .sweep_file import LARGEST_SWEEP, SweepFile, read_files

VALIDATED = 1000
"""Cases of a sweep that are validated before it starts; of a larger one so many, evenly spaced, the
rest in their turn."""


@record
class Base:
    """A problem in a variant: what the axes are crossed with.

    Attributes
    ----------
    problem, variant : str
        Names; the variant's may be empty.
    data : dict
        Plain content of the problem's file.
    fixed : dict
        Dotted keys that the sweep sets for all of its cases.
    folder : Path
        Where the problem's file is.
    """

    problem: str
    variant: str
    data: Keyed
    fixed: Keyed
    folder: Path


class Sweep:
    """The cases of a sweep file, a sequence: problems slowest, the last axis fastest.

    Attributes
    ----------
    file : SweepFile
    bases : list of Base
    axes : list of Axis
    shape : tuple of int
        Entries of the bases and of each axis; `numpy.unravel_index` of a case's place gives its
        entries.
    content : tuple
        What `read_files` read.
    names : dict of str to str
        What the dotted keys of the axes are called.
    """

    def __init__(self, source: str, data: Keyed, problems: dict[str, Keyed]) -> None:
        self.content = (source, data, problems)
        self.source = source
        self.file: SweepFile = parse(SweepFile, data, source)
        self.axes, names = make_axes(self.file, list(problems.values()), source)
        self.bases = list(_bases(self.file, problems, source))
        keys = [key for axis in self.axes for key in axis.keys]
        for key in keys:
            if keys.count(key) > 1 or any(key in base.fixed for base in self.bases):
                raise InputError(f"{source}: {key}: the key is set elsewhere in this file too")
        self.names = {key: names[key] for key in keys}
        self.shape = (len(self.bases), *(len(axis.values) for axis in self.axes))
        if len(self) > LARGEST_SWEEP:
            raise InputError(f"{source}: {len(self)} cases; the largest sweep has {LARGEST_SWEEP}")

    def __len__(self) -> int:
        return math.prod(self.shape)

    def __getitem__(self, place: int) -> Problem:
        if not 0 <= place < len(self):
            raise IndexError(place)
        base, varied = self._entries(place)
        source = f"{self.source}: {self.ids[place]}"
        data = copy.deepcopy(base.data)
        given = files_in({**base.fixed, **varied}, base.folder)
        return parse_problem(data, source, given, base.folder)

    @functools.cached_property
    def ids(self) -> list[str]:
        """Ids of all cases, by place: readable, the same in every run, and names of files, such as
        ``example1-modified-rho1e3-h0.05``."""
        bases = [
            "-".join(filter(None, (base.problem, base.variant and value_word(base.variant))))
            for base in self.bases
        ]
        return [
            "-".join(words)
            for words in itertools.product(bases, *(axis.words for axis in self.axes))
        ]

    def coordinates(self, place: int) -> Keyed:
        """Problem, variant, and the values of the axes, of one case."""
        base, varied = self._entries(place)
        names = {"variant": base.variant} if base.variant else {}
        return {
            "problem": base.problem,
            **names,
            **dict(zip(self.names.values(), varied.values(), strict=True)),
        }

    @property
    def coordinate_names(self) -> list[str]:
        """Names of the coordinates, in the order of `coordinates`."""
        return ["problem", *(["variant"] if self.file.variant else []), *self.names.values()]

    @property
    def keep(self) -> str:
        """Which fields are kept: scalars, contact or all."""
        return self.file.keep or ("contact" if len(self) <= 1000 else "scalars")

    def only(self, patterns: Sequence[str]) -> list[int]:
        """Places of the cases whose id matches one of the shell patterns; all of them if there is
        no pattern.

        Raises
        ------
        InputError
            If a pattern matches nothing.
        """
        matches = {pattern: set(fnmatch.filter(self.ids, pattern)) for pattern in patterns}
        for pattern, names in matches.items():
            if not names:
                raise InputError(f"--only {pattern}: no case has such an id (--list shows them)")
        return [
            place
            for place, id_ in enumerate(self.ids)
            if not patterns or any(id_ in names for names in matches.values())
        ]

    def validate(self) -> None:
        """Make the cases, or of many an evenly spaced part of them.

        Raises
        ------
        InputError
            One line: file, case, key, what was given, what is allowed.
        """
        if len(set(self.ids)) < len(self):
            ordered = sorted(self.ids)
            twice = next(a for a, b in itertools.pairwise(ordered) if a == b)
            raise InputError(
                f"{self.source}: two cases have the id {twice}: is a value listed twice?"
            )
        for place in np.unique(
            np.linspace(0, len(self) - 1, min(VALIDATED, len(self))).round().astype(int)
        ).tolist():
            self[place]

    def _entries(self, place: int) -> tuple[Base, Keyed]:
        """The base of a case and the values of its axes by dotted key."""
        varied: Keyed = {}
        for axis in reversed(self.axes):
            place, entry = divmod(place, len(axis.values))
            varied = {**dict(zip(axis.keys, axis.values[entry], strict=True)), **varied}
        return self.bases[place], varied


def _bases(file: SweepFile, problems: dict[str, Keyed], source: str) -> Iterator[Base]:
    stems = {path: value_word(Path(path).stem) for path in problems}
    if len(set(stems.values())) < len(stems):
        raise InputError(
            f"{source}: problems: the files need names that differ in more than their folders, got "
            f"{list(problems)}"
        )
    fixed = {full_key(key, source): value for key, value in file.set.items()}
    for path, variant in itertools.product(problems, file.variant or ({},)):
        own = {full_key(key, source): value for key, value in variant.items() if key != "name"}
        yield Base(
            stems[path],
            variant.get("name", ""),
            problems[path],
            {**fixed, **own},
            Path(path).parent,
        )


def read_sweep(path: str | Path) -> Sweep:
    """The cases of a sweep file.

    Raises
    ------
    InputError
        One line: file, key or case, what was given, what is allowed.
    """
    return build_sweep(*read_files(path))


def build_sweep(source: str, data: Keyed, problems: dict[str, Keyed]) -> Sweep:
    """Cross what `read_files` read; the same on every rank.

    Raises
    ------
    InputError
        If a case is invalid, or two cases would have the same id.
    """
    sweep = Sweep(source, data, problems)
    sweep.validate()
    return sweep
