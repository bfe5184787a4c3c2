"""Models that do not change, and their copies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

import pydantic

from ...errors import InputError
from ...runtime.hints import among


class Frozen(pydantic.BaseModel):
    """A model whose fields are given once."""

    _others: ClassVar[tuple[str, ...]] = ()
    """Keys beside its fields that a copy takes."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in type(self).model_fields:
            raise InputError(
                f"{name}: a {type(self).__name__} does not change; "
                f".model_copy(update={{{name!r}: {value!r:.60}}}) returns one that has it, and "
                "checks no value"
            )
        super().__setattr__(name, value)

    def model_copy(self, *, update: Mapping[str, object] | None = None, deep: bool = False) -> Self:
        """A copy with other values, which are not checked.

        Raises
        ------
        InputError
            If a key does not exist.
        """
        for name in update or ():
            if name not in type(self).model_fields:
                keys = [*type(self).model_fields, *self._others]
                raise InputError(f"{name}: unknown key{among(name, keys)}")
        return super().model_copy(update=update, deep=deep)
