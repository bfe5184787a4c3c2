"""The models that an input model names in its fields."""

from __future__ import annotations

from typing import Any

import pydantic


def models_at(cls: Any, loc: list[int | str]) -> list[Any]:
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


def stands_in(cls: Any, key: str) -> str:
    """In which tables of an input a key stands; nothing where it stands in none."""
    fields = (field for model in models_below(cls) for field in model.model_fields.items())
    tables = {
        f"[{name}]": None
        for name, field in fields
        if any(key in model.model_fields for model in models_in(field.annotation))
    }
    return f"; it is a key of {', '.join(tables)}" if tables else ""


def models_below(cls: Any) -> list[Any]:
    """A model and all models of its fields."""
    inner = [m for field in cls.model_fields.values() for m in models_in(field.annotation)]
    return [cls, *(below for model in inner for below in models_below(model))]


def models_in(annotation: Any) -> list[Any]:
    """The models that an annotation names, over lists and unions."""
    if isinstance(annotation, type) and issubclass(annotation, pydantic.BaseModel):
        return [annotation]
    return [model for inner in getattr(annotation, "__args__", ()) for model in models_in(inner)]
