"""What a config may say, read from its models: a JSON Schema for editors."""

from __future__ import annotations

import re

from pydantic.json_schema import models_json_schema

from ..given.tables.base import Model
from ..given.tables.model_tree import Class, models_below
from ..untyped import Keyed

ENTRY = re.compile(
    r"^(\w[\w, ]*) : .*?(?:, in ((?:2D|axial|3D)(?:, \w+)*))?\n((?:[ \t]+.*\n|\n)*)", re.MULTILINE
)


def described(cls: Class) -> dict[str, tuple[str, str]]:
    """What the docstring's Attributes say of each field, in one line, and in which problems it
    counts: "2D, axial", "" for all; of the key that chooses a shape or condition that is so for
    all."""
    result = described(cls.__base__) if cls.__base__ not in (None, Model) else {}
    section = (cls.__doc__ or "").partition("Attributes\n    ----------\n")[2]
    text = "\n".join(line[4:] for line in section.splitlines()) + "\n"
    whole = ""
    for names, where, body in ENTRY.findall(text):
        whole = where if names in ("shape", "condition") else whole
        said = " ".join(body.split()), where or whole
        result |= {name.strip(): said for name in names.split(",")}
    return result


def json_schema(models: dict[str, type[Model]]) -> Keyed:
    """The JSON Schema of a file, with the descriptions of the docstrings.

    Parameters
    ----------
    models : mapping of str to type of Model
        What the file may be, each by the key that identifies it; the last one, with the key "", is
        the default.
    """
    keys, definitions = models_json_schema([(model, "validation") for model in models.values()])
    for model in {below for root in models.values() for below in models_below(root)}:
        entry = definitions["$defs"][model.__name__]
        entry["description"] = summary(model)
        for name, (text, _) in described(model).items():
            if name in entry["properties"]:
                entry["properties"][name]["description"] = text
    chosen: Keyed = {}
    for key, model in reversed(models.items()):
        this = keys[model, "validation"]
        chosen = {"if": {"required": [key]}, "then": this, "else": chosen} if key else this
    return {"$schema": "http://json-schema.org/draft-07/schema#", **chosen, **definitions}


def summary(model: Class) -> str:
    """Return what the docstring of a model says in its first paragraph."""
    return " ".join((model.__doc__ or "").split("\n\n")[0].split())
