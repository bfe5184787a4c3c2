"""What a case is, as a digest: config, content of the files that it names, PETSc options,
quantities asked for, version.

A result is used again only for a case of the same digest.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from ... import __version__
from ...errors import InputError
from ...given.tables.base import regular_file
from ...model.case import names_file
from ...untyped import Keyed
from .sweep import Sweep

HARMLESS = (
    "monitor",
    "view",
    "log_",
    "info",
    "help",
    "options_",
    "malloc",
    "citations",
    "nox",
    "objects_dump",
    "no_signal_handler",
    "version",
    "skip_petscrc",
)
"""Parts of the names of PETSc options that change what is shown and never a digit."""


class Identity:
    """Digests of the cases of a sweep.

    Parameters
    ----------
    sweep : Sweep
    facts : dict
        What does not follow from the sweep file, as plain data: "bases", a digest for each base of
        the sweep, and "files", that of each file which the values of an axis name.
    """

    def __init__(self, sweep: Sweep, facts: Keyed) -> None:
        self.facts = facts
        self._shape, self._bases = sweep.shape, facts["bases"]
        folder = sweep.bases[0].folder
        self._entries = [
            [
                _text(
                    [
                        [
                            key,
                            value,
                            *(
                                facts["files"][name]
                                for name, _ in named_files({key: value}, folder)
                            ),
                        ]
                        for key, value in zip(axis.keys, some, strict=True)
                    ]
                )
                for some in axis.values
            ]
            for axis in sweep.axes
        ]

    def digest(self, place: int) -> str:
        """32 hexadecimal digits for one case."""
        words = []
        for size, entries in zip(reversed(self._shape[1:]), reversed(self._entries), strict=True):
            place, digit = divmod(place, size)
            words.append(entries[digit])
        return _digest("\n".join([self._bases[place], *words]))


def identify(
    sweep: Sweep,
    options: Mapping[str, str] = {},
    functions: Mapping[str, Callable[..., object]] = {},
) -> Identity:
    """The digests as things are now.

    Parameters
    ----------
    sweep : Sweep
    options : mapping of str to str
        PETSc options of the command line and of options files.
    functions : mapping of str to callable
        The user's own quantities.
    """
    digits = {
        name: text for name, text in options.items() if not any(part in name for part in HARMLESS)
    }
    functions_text = {name: _source(function) for name, function in functions.items()}
    common = [__version__, sorted(digits.items()), sweep.file.von_mises, functions_text]
    bases = []
    for base in sweep.bases:
        contents = [
            file_digest(path)
            for _, path in named_files({**base.data, "set": base.fixed}, base.folder)
        ]
        bases.append(
            _digest(
                _text(
                    [
                        common,
                        base.problem,
                        base.variant,
                        base.data,
                        sorted(base.fixed.items()),
                        contents,
                    ]
                )
            )
        )
    varied = [
        dict(zip(axis.keys, some, strict=True)) for axis in sweep.axes for some in axis.values
    ]
    files = {name: file_digest(path) for name, path in named_files(varied, sweep.bases[0].folder)}
    return Identity(sweep, {"bases": bases, "files": files})


def named_files(data: object, folder: Path) -> Iterator[tuple[str, Path]]:
    """Files that plain data name, as they are given and where they are, relative to the problem's
    folder."""
    if isinstance(data, Mapping):
        for key, value in data.items():
            if names_file(key, value):
                yield value, folder / re.sub(r":\d+$", "", value)
            else:
                yield from named_files(value, folder)
    elif isinstance(data, (list, tuple)):
        for value in data:
            yield from named_files(value, folder)


@functools.lru_cache(maxsize=1024)
def _file_digest(path: str, size: int, changed: int) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def file_digest(path: Path) -> str:
    """Return the digest of a regular file's content. It is empty where the file is none or cannot
    be read; the case will meet that in its turn."""
    try:
        # the content of larger files is not looked at
        facts = regular_file(path, 4_000_000_000).stat()
        return _file_digest(str(path), facts.st_size, facts.st_mtime_ns)
    except (OSError, InputError):
        return ""


def _source(function: Callable[..., object]) -> str:
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return repr(getattr(function, "__qualname__", function))


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _text(data: object) -> str:
    return json.dumps(data, sort_keys=True, default=str)
