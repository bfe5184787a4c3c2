"""The models that an input model names in its fields."""

from __future__ import annotations

import itertools
from typing import Any

import pydantic

from ...runtime.hints import nearest
from ...runtime.other_words import SYNONYMS

Class = type[pydantic.BaseModel]
Place = list[int | str]
"""Keys and numbers that lead to a value of an input."""
FEW = 3
"""Keys of a table that are all named, whatever else is known of a key that is not among them, and
most tables in which a key says something."""


def instead(cls: Class, loc: Place, data: object) -> str:
    """A key that is meant, the tables in which this one stands, or the keys that there are."""
    models = [m for m in models_at(cls, loc[:-1]) if loc[-1] not in m.model_fields]
    keys = sorted({name for model in models for name in model.model_fields})
    key, valid = str(loc[-1]), f"; valid keys: {', '.join(keys)}"
    given = where_given(data, SYNONYMS.get(key, key)) if len(loc) == 1 else []
    there = f", did you mean {' or '.join(given[:3])}?" if given else ""
    near, few = nearest(key, keys), len(keys) <= FEW
    near, said = ("", near) if few and near.startswith(";") else (near, "")
    # a key of another table is more likely meant than a similar one of this table
    elsewhere = "" if few else stands_in(cls, key, loc)
    return of_another(cls, loc) or there or elsewhere or near or f"{valid}{said}"


def models_at(cls: Class, loc: Place) -> list[Class]:
    """The models that may stand at `loc`, over lists, unions and optional fields; tags choose among
    a union's."""
    models = [cls]
    for step in loc:
        following = [
            m
            for model in models
            if isinstance(step, str) and step in model.model_fields
            for m in models_in(model.model_fields[step].annotation)
        ]
        named = [
            m
            for m in models
            if isinstance(step, str)
            and step in [field.default for field in m.model_fields.values()]
        ]
        models = following or named or models
    return models


def stands_in(cls: Class, key: str, loc: Place) -> str:
    """In which other tables of an input a key stands; nothing where it stands in none, in many, or
    in other entries of the array that leads to `loc`."""
    fields = (field for model in models_below(cls) for field in model.model_fields.items())
    tables = {
        f"[{name}]": None
        for name, field in fields
        if any(key in model.model_fields for model in models_in(field.annotation))
    }
    here = {f"[{name}]" for name, k in itertools.pairwise(loc) if isinstance(k, int)}
    if here & tables.keys():
        return ""
    tables |= {"the top of the file": None} if key in cls.model_fields else {}
    return f"; it is a key of {', '.join(tables)}" if 0 < len(tables) <= FEW else ""


def of_another(cls: Class, loc: Place) -> str:
    """Which other shapes, conditions, ... have a key that the one at hand has not."""
    key, tag = loc[-1], loc[-2] if len(loc) > 1 else ""
    (model, *_) = models_at(cls, loc[:-1])
    names = [name for name, field in model.model_fields.items() if field.default == tag]
    others = [other.model_fields for other in models_at(cls, loc[:-2]) if names]
    tags = {repr(each[names[0]].default): None for each in others if {key, names[0]} <= {*each}}
    known = not names or key in model.model_fields or not tags
    return "" if known else f"; it is a key of {names[0]} = {' or '.join(tags)}"


def where_given(data: Any, key: str, above: str = "") -> list[str]:
    """The dotted keys of an input that end with a key, but for the key itself.

    >>> where_given({"bound": 3, "boundary": [{"bound": 1}]}, "bound")
    ['boundary.0.bound']
    """
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    found = list[str]()
    for name, value in entries:
        found += [f"{above}{name}"] if above and name == key else []
        if isinstance(value, (dict, list)):
            found += where_given(value, key, f"{above}{name}.")
    return found


def models_below(cls: Class) -> list[Class]:
    """A model and all models of its fields."""
    inner = [m for field in cls.model_fields.values() for m in models_in(field.annotation)]
    return [cls, *(below for model in inner for below in models_below(model))]


def models_in(annotation: object) -> list[Class]:
    """The models that an annotation names, over lists and unions."""
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        return [annotation]
    return [model for inner in getattr(annotation, "__args__", ()) for model in models_in(inner)]
