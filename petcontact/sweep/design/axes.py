"""Axes of a sweep: keys whose values change together, and the words that they give to the ids of the cases."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numpy as np

from ...errors import InputError
from ...model.case import KEYS, whole_key
from .sweep_file import Sample, SweepFile

FIRST_WORDS = {"method.rule": "", "method.rho": "rho", "mesh.element_size": "h"}
"""Keys that come first in an id, in this order, and the names that they have there."""
LONGEST_VALUE = 24
"""Characters of a value in an id; a longer one is cut and told apart by a hash."""


@dataclass(frozen=True)
class Axis:
    """Keys that change together.

    Attributes
    ----------
    keys : tuple of str
        Dotted keys.
    values : list of tuple
        One an entry, one value a key.
    words : list of str
        What each entry is called in an id.
    """

    keys: tuple[str, ...]
    values: list[tuple[Any, ...]]
    words: list[str]


def make_axes(file: SweepFile, source: str) -> list[Axis]:
    """Those of `cross`, one a key; of `zip`, `sample` and `points`, one each.

    Raises
    ------
    InputError
        If a key is given twice or its entries cannot be told apart.
    """
    axes = [_listed((full_key(key, source),), [(value,) for value in values]) for key, values in file.cross.items()]
    if file.zip:
        axes.append(_listed(tuple(full_key(key, source) for key in file.zip), list(zip(*file.zip.values(), strict=True))))
    if file.sample is not None:
        keys = tuple(full_key(key, source) for key in file.sample.range)
        axes.append(_numbered(keys, sampled(file.sample), "sample"))
    if file.points:
        assert not isinstance(file.points, str)
        axes.append(_numbered(tuple(full_key(key, source) for key in file.points),
                              list(zip(*file.points.values(), strict=True)), "point"))  # fmt: skip
    for axis in axes:
        if len(set(axis.words)) < len(axis.words):
            word = next(word for k, word in enumerate(axis.words) if word in axis.words[:k])
            raise InputError(f"{source}: {', '.join(axis.keys)}: two cases have the id ...{word}: is a value listed twice?")
    return axes


def _listed(keys: tuple[str, ...], values: list[tuple[Any, ...]]) -> Axis:
    return Axis(keys, values, ["-".join(key_word(k, v) for k, v in zip(keys, some, strict=True)) for some in values])


def _numbered(keys: tuple[str, ...], values: list[tuple[Any, ...]], name: str) -> Axis:
    return Axis(keys, values, [f"{name}{number}" for number in range(1, len(values) + 1)])


def sampled(sample: Sample) -> list[tuple[float, ...]]:
    """Points of a design, the same for the same seed."""
    import warnings

    from scipy.stats import qmc

    kind = {"latin-hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}[sample.method]
    engine = kind(d=len(sample.range), seed=sample.seed)
    with warnings.catch_warnings():
        # scipy warns of a number of Sobol points that is no power of two
        warnings.simplefilter("ignore", UserWarning)
        unit = engine.random(sample.points)
    columns = []
    for (key, (low, high)), part in zip(sample.range.items(), unit.T, strict=True):
        columns.append(low * (high / low) ** part if key in sample.log else low + (high - low) * part)
    return [tuple(map(float, point)) for point in np.transpose(columns)]


def full_key(key: str, source: str) -> str:
    """The dotted key of a short one: rho is method.rho, element_size is mesh.element_size.

    Raises
    ------
    InputError
        If there is no such key.
    """
    found = whole_key(key)
    if "." not in found and found not in KEYS:
        raise InputError(f"{source}: {key}: neither a key of [method], [mesh] or [bem] nor a dotted key")
    return found


def key_word(key: str, value: Any) -> str:
    """A key and its value in an id: `rho1e3`, `poissonratio0.2`; a rule stands for itself."""
    return FIRST_WORDS.get(key, key.rsplit(".", 1)[-1].replace("_", "")) + value_word(value)


def value_word(value: Any) -> str:
    """A value as part of an id; different numbers give different texts."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    text = value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)
    plain = re.sub(r"[^\w.+]+", "-", text).strip("-.") or "empty"
    if len(plain) > LONGEST_VALUE:
        return f"{plain[:LONGEST_VALUE]}~{hashlib.sha256(text.encode()).hexdigest()[:6]}"
    return plain


def short_number(value: float) -> str:
    """The shorter of 1000.0 and 1e3 without what says nothing."""
    scientific = f"{Decimal(repr(value)).normalize():e}".replace("e+", "e")
    return min(repr(value).removesuffix(".0"), scientific, key=len)


def short_names(keys: list[str]) -> list[str]:
    """The last word of each dotted key where that is unique: rho, not method.rho."""
    last = [key.rsplit(".", 1)[-1] for key in keys]
    return [word if last.count(word) == 1 else key for key, word in zip(keys, last, strict=True)]
