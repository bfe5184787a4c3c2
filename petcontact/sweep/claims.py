"""Who does what in a sweep, as empty files in one folder.

A file is created by exactly one process, on network file systems too; so ranks share work without a master and without
messages that a rank in the middle of an LU could not answer.
"""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .cost import Group


@dataclass
class State:
    """What a board says: workers by group, and the places of the cases claimed, done and failed (done includes them)."""

    workers: Counter[int] = field(default_factory=Counter)
    claimed: set[int] = field(default_factory=set)
    done: set[int] = field(default_factory=set)
    failed: set[int] = field(default_factory=set)


class Board:
    """The folder of one run; it must be empty when the run starts."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def join(self, group: int, worker: int) -> bool:
        """Become worker number `worker` of a group; False if another team was faster."""
        return self._create(f"group-{group}-{worker}")

    def claim(self, place: int) -> bool:
        """Take a case; False if it is taken."""
        return self._create(f"claim-{place}")

    def finish(self, place: int, *, failed: bool) -> None:
        """Say that the file of a case is on the disk."""
        if failed:
            self._create(f"failed-{place}")
        self._create(f"done-{place}")

    def read(self) -> State:
        """The state now."""
        state = State()
        with contextlib.suppress(FileNotFoundError):
            for name in os.listdir(self.folder):
                word, number, *_ = name.split("-")
                if word == "group":
                    state.workers[int(number)] += 1
                else:
                    {"claim": state.claimed, "done": state.done, "failed": state.failed}[word].add(int(number))
        return state

    def next_group(self, groups: Sequence[Group]) -> int | None:
        """Join the group where this team helps most; None when there is no work left for it."""
        while True:
            state = self.read()
            chosen = most_useful(groups, state)
            if chosen is None or self.join(chosen, state.workers[chosen]):
                return chosen

    def _create(self, name: str) -> bool:
        try:
            os.close(os.open(self.folder / name, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            return False
        return True


def most_useful(groups: Sequence[Group], state: State) -> int | None:
    """The group that would end last, if one more team makes it end earlier.

    With R seconds of cases open and w teams at work on them it ends after R/w; a further team prepares for p seconds
    first, and then it ends after (R + p)/(w + 1), which is earlier if R > w p.
    """
    best, latest = None, 0.0
    for number, group in enumerate(groups):
        rest = group.case * sum(place not in state.claimed for place in group.cases)
        workers = state.workers[number]
        end = (rest + group.prepare) / (workers + 1)
        if rest > workers * group.prepare and end > latest:
            best, latest = number, end
    return best
