"""Records: dataclasses whose fields are set once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """A dataclass that is compared, hashed and printed by its fields, which cannot be set again."""
    return dataclass(frozen=True)(cls)
