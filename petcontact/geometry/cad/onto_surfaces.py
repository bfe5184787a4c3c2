"""Points brought onto the surfaces of a CAD file, by a worker that stays for as long as somebody
may ask."""

from __future__ import annotations

import contextlib
import functools
import json
import subprocess
import sys
import weakref
from collections.abc import Sequence
from typing import cast

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...untyped import Keyed
from ..round_surfaces import RIM
from . import worker


class Projector:
    """The worker for one file, and what it has answered: most panels of a mesh are those of the one
    before.

    Parameters
    ----------
    file : str
    """

    def __init__(self, file: str) -> None:
        self._file, self._known = file, dict[tuple[tuple[int, ...], bytes], Array]()
        self._process = subprocess.Popen(
            [sys.executable, worker.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        weakref.finalize(self, _end, self._process)

    def onto(self, surfaces: Sequence[tuple[int, ...]], points: Array) -> Array:
        """Points (n, k, 3) of panels, NaN where there is none, on that of its surfaces which a
        whole panel is nearest to.

        Points near an edge of that surface, by the size of the panel, come onto the edge.

        Raises
        ------
        InputError
            If the worker fails.
        """
        there = ~np.isnan(points[:, :, 0])
        keys = [(own, panel.tobytes()) for own, panel in zip(surfaces, points, strict=True)]
        new = [k for k, key in enumerate(keys) if key not in self._known]
        panels = [{"surfaces": surfaces[k], "points": points[k][there[k]].tolist()} for k in new]
        answer = self._answer({"file": self._file, "panels": panels, "rim": RIM}) if new else []
        for k, near in zip(new, answer, strict=True):
            self._known[keys[k]] = np.full_like(points[k], np.nan)
            self._known[keys[k]][there[k]] = near
        return np.array([self._known[key] for key in keys]).reshape(points.shape)

    def _answer(self, request: Keyed) -> list[list[list[float]]]:
        assert self._process.stdin is not None and self._process.stdout is not None
        line = ""
        if (
            self._process.poll() is None
        ):  # writing to a pipe that nobody reads may end the command without a word
            with contextlib.suppress(OSError):
                print(json.dumps(request), file=self._process.stdin, flush=True)
                line = self._process.stdout.readline()
        answer: Keyed = json.loads(line or '{"error": "Gmsh ended"}')
        if "points" not in answer:
            why = next(iter(answer.values()), "").splitlines()[0]
            raise InputError(f"{self._file}: panels cannot be brought onto its surfaces ({why})")
        return cast(list[list[list[float]]], answer["points"])


def _end(process: subprocess.Popen[str]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    process.wait()


@functools.lru_cache(maxsize=4)
def projector(file: str, stamp: int, process: int) -> Projector:
    """Return the `Projector` of a file, one for each time of its last change and each process."""
    return Projector(file)
