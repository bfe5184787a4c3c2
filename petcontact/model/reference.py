"""What a config may say, read from its models: a reference in Markdown and a JSON Schema for
editors."""

from __future__ import annotations

import json
import re
import textwrap
import typing
from typing import Any

import numpy as np
from pydantic.json_schema import models_json_schema

from .base import Model, models_in

ENTRY = re.compile(
    r"^(\w[\w, ]*) : .*?(?:, in ((?:2D|axial|3D)(?:, \w+)*))?\n((?:[ \t]+.*\n|\n)*)", re.MULTILINE
)
EXAMPLE = re.compile(r"In a config::\n\n((?: {8}.*\n)+)")


def described(cls: type[Model]) -> dict[str, tuple[str, str]]:
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


def json_schema(models: dict[str, type[Model]]) -> dict[str, Any]:
    """The JSON Schema of a file, with the descriptions of the docstrings.

    Parameters
    ----------
    models : mapping of str to type of Model
        What the file may be, each by the key that identifies it; the last one, with the key "", is
        the default.
    """
    keys, definitions = models_json_schema([(model, "validation") for model in models.values()])
    for model in {model for root in models.values() for _, model in _places(root)}:
        entry = definitions["$defs"][model.__name__]
        entry["description"] = _summary(model)
        for name, (text, _) in described(model).items():
            if name in entry["properties"]:
                entry["properties"][name]["description"] = text
    chosen: dict[str, Any] = {}
    for key, model in reversed(models.items()):
        this = keys[model, "validation"]
        chosen = {"if": {"required": [key]}, "then": this, "else": chosen} if key else this
    return {"$schema": "http://json-schema.org/draft-07/schema#", **chosen, **definitions}


def markdown(models: dict[str, type[Model]]) -> str:
    """One table a model: key, what it takes, default, meaning; what several files share is printed
    once."""
    definitions = json_schema(models)["$defs"]
    places: dict[type[Model], str] = {}
    for key, root in reversed(models.items()):
        for place, model in _places(root):
            places.setdefault(model, place or f"Top of the file{f', with `{key}`' if key else ''}")
    return "\n".join(
        _table(place, model, definitions[model.__name__]) for model, place in places.items()
    )


def _places(cls: type[Model], place: str = "") -> list[tuple[str, type[Model]]]:
    """Each model below a model, with the name of its TOML table; a model that may stand at several
    places stands once."""
    found: list[tuple[str, type[Model]]] = [(place, cls)]
    for name, field in cls.model_fields.items():
        inner = models_in(field.annotation)
        path = f"{place.strip('[]')}.{name}".strip(".")
        for model in inner:
            tag = _tag(model) if len(inner) > 1 else ""
            brackets = "[[{}]]" if _is_array(field.annotation) else "[{}]"
            for there, reached in _places(model, brackets.format(path)):
                if reached not in [other for _, other in found]:
                    found.append((f"{there}{tag if reached is model else ''}", reached))
    return found


def _tag(model: type[Model]) -> str:
    """` shape = "rectangle"`: the key that chooses one of several models."""
    for name, field in model.model_fields.items():
        if (
            typing.get_origin(field.annotation) is typing.Literal
            and len(typing.get_args(field.annotation)) == 1
        ):
            return f' {name} = "{field.default}"'
    return ""


def _is_array(annotation: Any) -> bool:
    """Whether TOML writes the models of an annotation as an array of tables."""
    if typing.get_origin(annotation) in (tuple, list):
        return True
    return any(_is_array(inner) for inner in typing.get_args(annotation))


def _summary(model: type[Model]) -> str:
    return " ".join((model.__doc__ or "").split("\n\n")[0].split())


def _table(place: str, model: type[Model], entry: dict[str, Any]) -> str:
    head = f"## `{place}`" if place.startswith("[") else f"## {place}"
    lines = [
        head,
        "",
        _summary(model),
        "",
        "| key | takes | default | 2D / axial / 3D | meaning |",
        "| --- | --- | --- | --- | --- |",
    ]
    says = described(model)
    for name, item in entry["properties"].items():
        required = name in entry.get("required", ())
        default = "required" if required else _shown(item.get("default"))
        text, where = says.get(name, ("", ""))
        cells = (f"`{name}`", _takes(item), default, where or "all", text)
        # an unescaped bar, as of |σ_t|, would end the cell
        shown = (cell.replace("\\", "\\\\").replace("|", "\\|") for cell in cells)
        lines.append(f"| {' | '.join(shown)}".rstrip() + " |")
    for example in EXAMPLE.findall(model.__doc__ or ""):
        lines += ["", "```toml", textwrap.dedent(example).rstrip(), "```"]
    return "\n".join([*lines, ""])


def _takes(item: dict[str, Any]) -> str:
    """The values that a property takes, in a few words."""
    if "const" in item or "enum" in item:
        return ", ".join(f'`"{value}"`' for value in item.get("enum", [item.get("const")]))
    if "$ref" in item or "discriminator" in item:
        return "table"
    if "anyOf" in item or "oneOf" in item:
        kinds = [
            _takes(one) for one in item.get("anyOf") or item["oneOf"] if one.get("type") != "null"
        ]
        return (
            "number or expression"
            if kinds == ["number", "text"]
            else " or ".join(dict.fromkeys(kinds))
        )
    kind = item.get("type", "")
    if kind == "array":
        count = len(item["prefixItems"]) if "prefixItems" in item else 0
        inner = _takes(item["prefixItems"][0] if count else item.get("items", {}))
        return f"{count} × {inner}" if count else f"list of {inner}"
    bounds = [
        f"{sign} {item[key]:g}"
        for key, sign in (
            ("exclusiveMinimum", ">"),
            ("minimum", "≥"),
            ("exclusiveMaximum", "<"),
            ("maximum", "≤"),
        )
        if abs(item.get(key, np.inf)) < 1e50
    ]
    word = {
        "string": "text",
        "integer": "whole number",
        "boolean": "true or false",
        "object": "table",
    }.get(kind, kind)
    return " ".join([word, ", ".join(bounds)]).strip()


def _shown(value: Any) -> str:
    if value is None or value in ({}, [], "") or isinstance(value, dict):
        return ""
    return f"`{json.dumps(value)}`"
